// The header of a classic netCDF file: its dimensions, attributes and variables. Numbers are big endian, and those that count have 32 bits
// (versions 1 and 2) or 64 (version 5). Source: the NetCDF Classic Format Specification,
// https://docs.unidata.ucar.edu/netcdf-c/current/file_format_specifications.html
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "data/volume_io/sample_type.h"

namespace slabstream {

// One of them: characters, or numbers. Neither: it holds more than AttributedFile::kMostAttributeBytes.
struct NetcdfAttribute {
  std::optional<std::string> text = {};
  std::optional<std::vector<double>> numbers = {};
};

using NetcdfAttributes = std::map<std::string, NetcdfAttribute>;

struct NetcdfVariable {
  std::vector<std::string> dimensions;
  std::vector<std::uint64_t> size;  // along each dimension; of the unlimited one, the number of records
  std::optional<SampleType> type;   // nullopt: characters
  bool records = false;             // its first dimension is the unlimited one: its records lie `record_bytes` apart
  std::uint64_t begin = 0;          // byte of the file
  std::uint64_t piece_bytes = 0;    // that lie next to each other: of a record, or of all of it; at most the largest number
  NetcdfAttributes attributes;
};

struct NetcdfHeader {
  int version = 0;                 // 1, 2 or 5
  std::uint64_t record_bytes = 0;  // of one record of all variables that have records
  NetcdfAttributes attributes;     // of the file
  std::map<std::string, NetcdfVariable> variables;
};

// `file`: the descriptor of a file of `file_bytes`. `path`: for messages. InvalidArgument: it has another version. DataLoss: it is damaged;
// the message names what is wrong, its value and the limit. ResourceExhausted: the header takes more than 16 MiB.
Result<NetcdfHeader> ReadNetcdfHeader(int file, std::uint64_t file_bytes, const std::string& path);

// Big-endian numbers of a type as they are stored.
std::vector<double> NetcdfNumbers(SampleType type, std::vector<std::byte> stored);

// a * b and a + b, or the largest number where that is more.
std::uint64_t BoundedProduct(std::uint64_t a, std::uint64_t b);
std::uint64_t BoundedSum(std::uint64_t a, std::uint64_t b);

}  // namespace slabstream
