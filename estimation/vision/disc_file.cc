// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstring>
#include <string_view>

#include "tangible/estimation/vision/checksum.h"
#include "tangible/estimation/vision/disc_data.h"
#include "tangible/scene/json_reader.h"
#include "tangible/scene/text_file.h"

namespace tangible {
namespace {

constexpr char kMagic[] = "tangible discs 2\n";
constexpr char kMagicOfFirstVersion[] = "tangible discs 1\n";
constexpr int kMostFrames = 100000;
constexpr int kMostSequences = 1000000;

constexpr char kChecksumKey[] = "crc32";

// The checksum of the header without it, and of the body.
std::uint32_t ChecksumOf(Json header, std::string_view body) {
  header.erase(kChecksumKey);
  return Checksum({header.dump(-1, ' ', false, Json::error_handler_t::replace), "\n", body});
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
    if (count > left() / sizeof(T)) return false;
    std::memcpy(values, bytes_.data() + at_, count * sizeof(T));
    at_ += count * sizeof(T);
    return true;
  }
  bool Read(size_t count, std::string* text) {
    if (count > left()) return false;
    text->assign(bytes_, at_, count);
    at_ += count;
    return true;
  }
  size_t left() const { return bytes_.size() - at_; }

 private:
  const std::string& bytes_;
  size_t at_;
};

// What is wrong with the next sequence, or empty.
std::string ReadSequence(Body* body, const DiscData& data, DiscSequence* sequence) {
  constexpr char kEnds[] = "the file ends within it";
  const size_t numbers = static_cast<size_t>(data.frames) * 4 * data.world.size();
  // A forged header may claim more than memory holds.
  if (numbers * sizeof(double) > body->left()) return kEnds;
  sequence->states.resize(numbers);
  sequence->pictures.resize(data.frames);
  if (!body->Read(numbers, sequence->states.data())) return kEnds;
  const auto finite = [](double x) { return std::isfinite(x); };
  if (!std::all_of(sequence->states.begin(), sequence->states.end(), finite)) {
    return "expected finite states";
  }
  std::vector<unsigned char> pixels(kPictureBytes);
  for (std::string& picture : sequence->pictures) {
    std::uint32_t size = 0;
    if (!body->Read(1, &size) || !body->Read(size, &picture)) return kEnds;
    if (!Decompress(picture, pixels.data())) return "expected pictures, got one that is damaged";
  }
  return "";
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
  Json header = {{"kind", NameOf(data.kind)},
                 {"seed", data.seed},
                 {"frames", data.frames},
                 {"sequences", data.num_sequences()},
                 {"bytes", body.size()}};
  header[kChecksumKey] = ChecksumOf(header, body);
  return kMagic + header.dump() + "\n" + body;
}

bool ParseDiscData(const std::string& bytes, const std::string& name_for_messages, DiscData* data,
                   std::string* error) {
  const auto fail = [&](const std::string& what) {
    *error = name_for_messages + ": " + what;
    return false;
  };
  const size_t magic = sizeof(kMagic) - 1;
  if (bytes.compare(0, magic, kMagicOfFirstVersion) == 0) {
    return fail("expected a data set of version 2, got one of version 1: make it again");
  }
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
  for (const char* key : {"seed", "frames", "sequences", "bytes", kChecksumKey}) {
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
  const std::string_view behind = std::string_view(bytes).substr(end + 1);
  if (ChecksumOf(json, behind) != json[kChecksumKey].get<std::uint64_t>()) {
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
    const std::string wrong = ReadSequence(&body, *data, &sequence);
    if (!wrong.empty()) return fail("sequence " + std::to_string(s) + ": " + wrong);
    data->sequences.push_back(std::move(sequence));
  }
  if (body.left() > 0) return fail("expected the file's end behind its sequences, got more");
  return true;
}

bool LoadDiscData(const std::string& file, DiscData* data, std::string* error) {
  std::string bytes;
  return ReadTextFile(file, &bytes, error) && ParseDiscData(bytes, file, data, error);
}

}  // namespace tangible
