// Transfer functions, as ParaView exports colour maps.
#include <algorithm>
#include <cmath>

#include "common/classification/transfer_function.h"
#include "tests/fuzz/decoders.h"
#include "tests/support/random_transfer.h"

namespace slabstream {

bool DecodeTransferFunction(std::span<const std::byte> bytes) {
  const Result<TransferFunction> transfer = ParseParaViewColorMap(FuzzInput(bytes).Text(), "map.json");
  if (!transfer.ok()) {
    CheckRefusal(transfer.status());
    return false;
  }
  CHECK(Validate(*transfer).ok());
  const Result<TransferFunction> again = ParseParaViewColorMap(FormatParaViewColorMap(*transfer, "again"), "again.json");
  CHECK(again.ok()) << again.status().message();
  CHECK(*again == *transfer);

  double before = transfer->opacities.front().value;
  for (const OpacityPoint& point : transfer->opacities) {
    for (const double value : {point.value, std::midpoint(before, point.value)}) {
      const double opacity = transfer->Opacity(value);
      CHECK(opacity >= 0 && opacity <= 1) << value << ": " << opacity;
      CHECK_LE(opacity, MaxOpacity(*transfer, before, point.value) + 1e-9) << value;
      const Rgb color = transfer->Color(value);
      CHECK(color.r >= 0 && color.r <= 1 && color.g >= 0 && color.g <= 1 && color.b >= 0 && color.b <= 1) << value;
    }
    before = point.value;
  }
  return true;
}

std::vector<FuzzBytes> TransferFunctionSeeds() {
  std::vector<FuzzBytes> seeds = {
      SeedOf(R"([{"Name": "ramp", "ColorSpace": "RGB", "RGBPoints": [0, 0, 0, 0, 255, 1, 1, 1]}])"),
      SeedOf(R"({"RGBPoints": [-1.5, 1, 0.5, 0, -1.5, 0, 0.5, 1], "Points": [-2, 0, 0.5, 0, 3e2, 1, 0, 1, 300, 0.25, 1, 0.5]})"),
      SeedOf(R"({"RGBPoints": [0, 0, 0, 0], "Material": {"ambient": 0.1, "shininess": 40}})")};
  Random random(45);
  for (int i = 0; i < 6; ++i) seeds.push_back(SeedOf(FormatParaViewColorMap(RandomTransfer(random), "random")));
  return seeds;
}

}  // namespace slabstream
