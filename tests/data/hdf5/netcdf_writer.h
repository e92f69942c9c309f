// Classic netCDF files for tests, written by the specification of the format (data/hdf5/netcdf_header.h).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "data/volume_io/sample_type.h"

namespace slabstream {

struct NetcdfWriter {
  struct Attribute {
    std::string name, text = {};
    std::vector<double> numbers = {};  // if there is no text
    SampleType type = SampleType::kFloat64;
  };
  struct Variable {
    std::string name;
    std::vector<std::size_t> dimensions;
    std::optional<SampleType> type;  // nullopt: characters
    std::vector<double> values;      // row by row
    std::vector<Attribute> attributes = {};
  };

  int version = 1;         // 1, 2 or 5
  bool streaming = false;  // the header does not say how many records there are
  std::uint64_t records = 0;
  std::vector<std::pair<std::string, std::uint64_t>> dimensions = {};  // of 0: the unlimited one
  std::vector<Attribute> attributes = {};
  std::vector<Variable> variables = {};

  std::string Bytes() const;

 private:
  std::string Count(std::uint64_t number) const;
  std::string Name(const std::string& name) const;
  std::string List(int tag, std::size_t count, const std::string& elements) const;
  std::string Attributes(const std::vector<Attribute>& list) const;
  std::uint64_t PieceBytes(const Variable& variable) const;  // of a record, or of all of it
  bool HasRecords(const Variable& variable) const;
  std::string Header(const std::vector<std::uint64_t>& begins) const;
};

}  // namespace slabstream
