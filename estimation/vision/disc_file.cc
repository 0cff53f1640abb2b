// SPDX-License-Identifier: Apache-2.0
#include <zlib.h>

#include <cstring>
#include <fstream>
#include <iterator>
#include <sstream>

#include "tangible/estimation/vision/disc_data.h"
#include "tangible/scene/json_reader.h"

namespace tangible {
namespace {

constexpr char kMagic[] = "tangible discs 1\n";
constexpr int kMostFrames = 100000;
constexpr int kMostSequences = 1000000;

std::uint32_t Checksum(const char* bytes, size_t size) {
  uLong sum = crc32(0L, Z_NULL, 0);
  // crc32 counts in 32 bits.
  constexpr size_t kPart = size_t{1} << 30;
  for (size_t at = 0; at < size; at += kPart) {
    sum = crc32(sum, reinterpret_cast<const Bytef*>(bytes + at),
                static_cast<uInt>(std::min(kPart, size - at)));
  }
  return static_cast<std::uint32_t>(sum);
}

template <typename T>
void Append(const T* values, size_t count, std::string* bytes) {
  bytes->append(reinterpret_cast<const char*>(values), count * sizeof(T));
}

// Reads what follows the header; false at the end of the bytes.
class Body {
 public:
  Body(const std::string& bytes, size_t at) : bytes_(bytes), at_(at) {}
  template <typename T>
  bool Read(size_t count, T* values) {
    if (count * sizeof(T) > bytes_.size() - at_) return false;
    std::memcpy(values, bytes_.data() + at_, count * sizeof(T));
    at_ += count * sizeof(T);
    return true;
  }
  bool Read(size_t count, std::string* text) {
    if (count > bytes_.size() - at_) return false;
    text->assign(bytes_, at_, count);
    at_ += count;
    return true;
  }
  bool ended() const { return at_ == bytes_.size(); }

 private:
  const std::string& bytes_;
  size_t at_;
};

bool ReadSequence(Body* body, const DiscData& data, DiscSequence* sequence) {
  sequence->states.resize(static_cast<size_t>(data.frames) * 4 * data.world.size());
  sequence->pictures.resize(data.frames);
  if (!body->Read(sequence->states.size(), sequence->states.data())) return false;
  for (std::string& picture : sequence->pictures) {
    std::uint32_t size = 0;
    if (!body->Read(1, &size) || !body->Read(size, &picture)) return false;
  }
  return true;
}

}  // namespace

std::string SerializeDiscData(const DiscData& data) {
  std::string body;
  for (const DiscSequence& sequence : data.sequences) {
    Append(sequence.states.data(), sequence.states.size(), &body);
    for (const std::string& picture : sequence.pictures) {
      const auto size = static_cast<std::uint32_t>(picture.size());
      Append(&size, 1, &body);
      body += picture;
    }
  }
  const Json header = {{"kind", NameOf(data.kind)}, {"seed", data.seed},
                       {"frames", data.frames},     {"sequences", data.num_sequences()},
                       {"bytes", body.size()},      {"crc32", Checksum(body.data(), body.size())}};
  return kMagic + header.dump() + "\n" + body;
}

bool ParseDiscData(const std::string& bytes, const std::string& name_for_messages, DiscData* data,
                   std::string* error) {
  const auto fail = [&](const std::string& what) {
    *error = name_for_messages + ": " + what;
    return false;
  };
  const size_t magic = sizeof(kMagic) - 1;
  if (bytes.compare(0, magic, kMagic) != 0) {
    return fail("expected a data set that tangible-vision made, got another file");
  }
  const size_t end = bytes.find('\n', magic);
  if (end == std::string::npos) return fail("header: expected a line of JSON, got the file's end");
  Json json;
  if (!ParseJson(bytes.substr(magic, end - magic), name_for_messages, &json, error)) return false;
  const auto whole = [&](const char* key) {
    return json.is_object() && json.contains(key) && json[key].is_number_unsigned();
  };
  for (const char* key : {"seed", "frames", "sequences", "bytes", "crc32"}) {
    if (!whole(key)) return fail(std::string("header: /") + key + ": expected a whole number >= 0");
  }
  const std::string kind = json.value("kind", Json()).is_string() ? json["kind"] : Json("");
  if (kind != "billiards" && kind != "simb") {
    return fail("header: /kind: expected billiards or simb, got " + OneLine(kind));
  }
  const auto size = json["bytes"].get<std::uint64_t>();
  const size_t found = bytes.size() - end - 1;
  if (found != size) {
    return fail("expected " + std::to_string(size) + " bytes behind the header, got " +
                std::to_string(found));
  }
  if (Checksum(bytes.data() + end + 1, found) != json["crc32"].get<std::uint64_t>()) {
    return fail("the file is damaged: its checksum is another one");
  }
  const auto frames = json["frames"].get<std::uint64_t>();
  const auto sequences = json["sequences"].get<std::uint64_t>();
  if (frames < 1 || frames > kMostFrames || sequences < 1 || sequences > kMostSequences) {
    return fail("header: expected 1 to " + std::to_string(kMostFrames) + " frames and 1 to " +
                std::to_string(kMostSequences) + " sequences, got " + std::to_string(frames) +
                " and " + std::to_string(sequences));
  }
  const DiscKind which = kind == "simb" ? DiscKind::kSimb : DiscKind::kBilliards;
  *data = {which, json["seed"].get<std::uint64_t>(), static_cast<int>(frames), WorldOf(which), {}};
  Body body(bytes, end + 1);
  for (std::uint64_t s = 0; s < sequences; ++s) {
    DiscSequence sequence;
    if (!ReadSequence(&body, *data, &sequence)) {
      return fail("sequence " + std::to_string(s) + ": the file ends within it");
    }
    data->sequences.push_back(std::move(sequence));
  }
  if (!body.ended()) return fail("expected the file's end behind its sequences, got more");
  return true;
}

bool LoadDiscData(const std::string& file, DiscData* data, std::string* error) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) {
    *error = file + ": expected a data set, got a file that cannot be read";
    return false;
  }
  const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
  return ParseDiscData(bytes, file, data, error);
}

}  // namespace tangible
