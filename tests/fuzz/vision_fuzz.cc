// SPDX-License-Identifier: Apache-2.0
// A first byte that chooses, then any bytes as a data set or a checkpoint of tangible-vision, as
// they are or with the checksum that they should have: refused with one line, or read; what is read
// is written and read again as the same bytes.
#include <cstdint>
#include <string>
#include <string_view>

#include "expect.h"
#include "tangible/estimation/vision/checksum.h"
#include "tangible/estimation/vision/disc_data.h"
#include "tangible/estimation/vision/training_file.h"
#include "tangible/scene/json_reader.h"

namespace {

using tangible::testing::Expect;
using tangible::testing::ExpectOneLine;

// The bytes of a data set with the size and the checksum of its body.
std::string WithChecksum(const std::string& bytes) {
  const std::string magic = "tangible discs 2\n";
  const size_t end = bytes.find('\n');
  if (end == std::string::npos) return bytes;
  tangible::Json header = tangible::Json::parse(bytes.substr(0, end), nullptr, false);
  if (!header.is_object()) return bytes;
  const std::string_view body = std::string_view(bytes).substr(end + 1);
  header.erase("crc32");
  header["bytes"] = body.size();
  const auto text = [&] {
    return header.dump(-1, ' ', false, tangible::Json::error_handler_t::replace);
  };
  header["crc32"] = tangible::Checksum({text(), "\n", body});
  return magic + text() + "\n" + std::string(body);
}

void ReadData(const std::string& bytes) {
  tangible::DiscData data, again;
  std::string error;
  if (!tangible::ParseDiscData(bytes, "d", &data, &error)) return ExpectOneLine(error);
  const std::string written = tangible::SerializeDiscData(data);
  Expect(tangible::ParseDiscData(written, "d", &again, &error), "what was written", error);
  Expect(tangible::SerializeDiscData(again) == written, "the same bytes", "");
}

void ReadTraining(const std::string& bytes) {
  tangible::TrainingFile training, again;
  std::string error;
  if (!tangible::ParseTraining(bytes, "c", &training, &error)) return ExpectOneLine(error);
  const std::string written = tangible::SerializeTraining(training);
  Expect(tangible::ParseTraining(written, "c", &again, &error), "what was written", error);
  Expect(again.weights == training.weights && again.iteration == training.iteration &&
             again.fingerprint == training.fingerprint,
         "the same training", "");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string bytes(reinterpret_cast<const char*>(data + 1), size - 1);
  switch (data[0] % 4) {
    case 0:
      ReadData(bytes);
      break;
    case 1:
      ReadData(WithChecksum(bytes));
      break;
    case 2:
      ReadTraining(bytes);
      break;
    default:
      // The text's first line as a fingerprint.
      const size_t end = bytes.find('\n');
      if (end == std::string::npos) return 0;
      const long iteration = 1 + data[0] / 4;
      ReadTraining(
          tangible::SerializeTraining({bytes.substr(0, end), iteration, bytes.substr(end + 1)}));
  }
  return 0;
}
