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

// What is read is written, and read again as the same bytes.
template <typename File>
void ReadTwice(const std::string& bytes,
               bool (*parse)(const std::string&, const std::string&, File*, std::string*),
               std::string (*serialize)(const File&)) {
  File file, again;
  std::string error;
  if (!parse(bytes, "f", &file, &error)) return ExpectOneLine(error);
  const std::string written = serialize(file);
  Expect(parse(written, "f", &again, &error), "what was written", error);
  Expect(serialize(again) == written, "the same bytes", "");
}

void ReadData(const std::string& bytes) {
  ReadTwice<tangible::DiscData>(bytes, &tangible::ParseDiscData, &tangible::SerializeDiscData);
}

void ReadTraining(const std::string& bytes) {
  ReadTwice<tangible::TrainingFile>(bytes, &tangible::ParseTraining, &tangible::SerializeTraining);
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
