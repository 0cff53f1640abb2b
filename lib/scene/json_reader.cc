// SPDX-License-Identifier: Apache-2.0
#include "tangible/scene/json_reader.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace tangible {
namespace {

// The text of a key or string for a message: escapes keep it printable and on one line.
std::string Quoted(const std::string& text) {
  constexpr std::size_t kLongest = 48;
  const std::string shown = text.size() > kLongest ? text.substr(0, kLongest) + "..." : text;
  return Json(shown).dump(-1, ' ', true, Json::error_handler_t::replace);
}

// A step of a JSON pointer (RFC 6901): "~" and "/" of the key are written "~0" and "~1".
std::string PointerStep(const std::string& key) {
  const std::string quoted = Quoted(key);
  std::string step = "/";
  for (std::size_t i = 1; i + 1 < quoted.size(); ++i) {
    if (quoted[i] == '~') {
      step += "~0";
    } else if (quoted[i] == '/') {
      step += "~1";
    } else {
      step += quoted[i];
    }
  }
  return step;
}

std::string Join(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& name : names) {
    if (!list.empty()) list += ", ";
    list += name;
  }
  return list;
}

// Builds a document from the parser's calls. The library's own builder silently keeps the last of
// two equal keys, but a scene with two masses is an error.
class DocumentBuilder : public nlohmann::json_sax<Json> {
 public:
  DocumentBuilder(const std::string& text, Json* root, JsonErrors* errors)
      : text_(text), root_(root), errors_(errors) {}

  bool null() override { return Add(nullptr) != nullptr; }
  bool boolean(bool value) override { return Add(value) != nullptr; }
  bool number_integer(std::int64_t value) override { return Add(value) != nullptr; }
  bool number_unsigned(std::uint64_t value) override { return Add(value) != nullptr; }
  bool number_float(double value, const std::string& /*text*/) override {
    return Add(value) != nullptr;
  }
  bool string(std::string& value) override { return Add(value) != nullptr; }
  bool binary(Json::binary_t& /*value*/) override { return false; }
  bool start_object(std::size_t /*size*/) override { return Open(Json::object()); }
  bool end_object() override { return Close(); }
  bool start_array(std::size_t /*size*/) override { return Open(Json::array()); }
  bool end_array() override { return Close(); }

  bool key(std::string& name) override {
    keys_.back() = name;
    if (!open_.back()->contains(name)) return true;
    errors_->Add(Pointer(), "key given twice in one object, expected once");
    return false;
  }

  bool parse_error(std::size_t position, const std::string& /*last_token*/,
                   const nlohmann::detail::exception& exception) override {
    // `position` counts the bytes read, the offending one included.
    const std::size_t end = std::min(position == 0 ? 0 : position - 1, text_.size());
    const auto line = 1 + std::count(text_.begin(), text_.begin() + end, '\n');
    const std::size_t newline = end == 0 ? std::string::npos : text_.rfind('\n', end - 1);
    const std::size_t column = newline == std::string::npos ? end + 1 : end - newline;
    errors_->Add("line " + std::to_string(line) + ", column " + std::to_string(column),
                 "malformed JSON: " + Reason(exception.what()));
    return false;
  }

 private:
  static constexpr std::size_t kMostReason = 200;

  // "[json.exception.x.101] parse error at line 1, column 2: reason" without the parts that are
  // reported elsewhere.
  static std::string Reason(const std::string& what) {
    const std::string prefix = "parse error at ";
    std::size_t begin = what.find("] ");
    begin = begin == std::string::npos ? 0 : begin + 2;
    if (what.compare(begin, prefix.size(), prefix) == 0) {
      const std::size_t colon = what.find(": ", begin);
      if (colon != std::string::npos) begin = colon + 2;
    }
    const std::string reason = what.substr(begin);
    // It quotes the last token, which may be a string of any length.
    return reason.size() <= kMostReason ? reason
                                        : reason.substr(0, kMostReason / 2) + " ... " +
                                              reason.substr(reason.size() - kMostReason / 2);
  }

  std::string Pointer() const {
    std::string pointer;
    for (std::size_t i = 0; i < open_.size(); ++i) {
      if (open_[i]->is_object()) {
        pointer += PointerStep(keys_[i]);
      } else {
        // An element that is being read has been added already.
        const std::size_t size = open_[i]->size();
        pointer += '/';
        pointer += std::to_string(i + 1 < open_.size() ? size - 1 : size);
      }
    }
    return pointer;
  }

  Json* Add(Json value) {
    if (open_.empty()) {
      *root_ = std::move(value);
      return root_;
    }
    Json& parent = *open_.back();
    if (parent.is_object()) return &(parent[keys_.back()] = std::move(value));
    parent.push_back(std::move(value));
    return &parent.back();
  }

  bool Open(Json value) {
    if (open_.size() >= static_cast<std::size_t>(kMaxJsonDepth)) {
      errors_->Add("malformed JSON", "nested too deep, expected at most " +
                                         std::to_string(kMaxJsonDepth) + " levels");
      return false;
    }
    open_.push_back(Add(std::move(value)));
    keys_.emplace_back();
    return true;
  }

  bool Close() {
    open_.pop_back();
    keys_.pop_back();
    return true;
  }

  const std::string& text_;
  Json* root_;
  JsonErrors* errors_;
  std::vector<Json*> open_;        // from the root to the container being read
  std::vector<std::string> keys_;  // of each open object, the key being read
};

}  // namespace

bool ParseJson(const std::string& text, const std::string& name_for_messages, Json* json,
               std::string* error) {
  JsonErrors errors(name_for_messages);
  *json = nullptr;
  // The parser treats a NUL byte as the end, whatever follows it.
  const std::string no_text = WhyNotText(text);
  if (!no_text.empty()) {
    errors.Add("", no_text);
    *error = errors.message();
    return false;
  }
  DocumentBuilder builder(text, json, &errors);
  if (Json::sax_parse(text, &builder)) return true;
  errors.Add("", "malformed JSON");
  *error = errors.message();
  return false;
}

bool ParseJsonFile(const std::string& file, Json* json, std::string* error) {
  std::string text;
  return ReadTextFile(file, &text, error) && ParseJson(text, file, json, error);
}

std::string Describe(const Json& value) {
  if (value.is_string()) return Quoted(value.get_ref<const std::string&>());
  if (value.is_array()) return "an array of " + std::to_string(value.size());
  if (value.is_object()) return "an object";
  return value.dump();
}

void JsonErrors::Add(const std::string& pointer, const std::string& what) {
  if (!ok()) return;
  message_ = OneLine(file_ + ": " + (pointer.empty() ? "" : pointer + ": ") + what);
}

void JsonReader::FailExpected(const std::string& expected) const {
  if (value_ == nullptr) {
    Fail("missing, expected " + expected);
  } else {
    Fail("expected " + expected + ", got " + Describe(*value_));
  }
}

void JsonReader::FailExpected(const std::string& expected, double number) const {
  Fail("expected " + expected + ", got " + Describe(value_ == nullptr ? Json(number) : *value_));
}

bool JsonReader::Has(const std::string& key) const { return IsObject() && value_->contains(key); }

JsonReader JsonReader::At(const std::string& key) const {
  const Json* member = Has(key) ? &*value_->find(key) : nullptr;
  return JsonReader(member, pointer_ + PointerStep(key), errors_);
}

JsonReader JsonReader::At(int index) const {
  const bool inside = index >= 0 && index < Size();
  return JsonReader(inside ? &(*value_)[static_cast<std::size_t>(index)] : nullptr,
                    pointer_ + "/" + std::to_string(index), errors_);
}

int JsonReader::Size() const { return IsArray() ? static_cast<int>(value_->size()) : 0; }

std::vector<std::string> JsonReader::Keys() const {
  std::vector<std::string> keys;
  if (!IsObject()) return keys;
  for (const auto& member : value_->items()) keys.push_back(member.key());
  return keys;
}

void JsonReader::ExpectKeys(const std::vector<std::string>& keys, const std::string& where,
                            const std::vector<std::string>& withdrawn) const {
  if (!IsObject()) return FailExpected("an object");
  for (const std::string& key : Keys()) {
    if (std::find(keys.begin(), keys.end(), key) != keys.end()) continue;
    if (std::find(withdrawn.begin(), withdrawn.end(), key) != withdrawn.end()) continue;
    At(key).Fail("unknown key" + where + ", expected one of " + Join(keys) + ", got " +
                 Quoted(key));
  }
}

int JsonReader::ExpectArray(const std::string& expected) const {
  if (!IsArray()) FailExpected(expected);
  return Size();
}

double JsonReader::Number(NumberKind kind) const {
  const double value = IsNumber() ? value_->get<double>() : 0.0;
  if (IsNumber() && IsAllowed(kind, value)) return value;
  FailExpected(Describe(kind));
  return 0.0;
}

int JsonReader::Integer(int low, int high) const {
  // 100.0 and 1e2 are integers too: many writers of JSON know only one kind of number.
  const double value =
      IsNumber() ? value_->get<double>() : std::numeric_limits<double>::quiet_NaN();
  if (value >= low && value <= high && value == std::floor(value)) return static_cast<int>(value);
  FailExpected("an integer in [" + std::to_string(low) + ", " + std::to_string(high) + "]");
  return 0;
}

bool JsonReader::Boolean() const {
  if (value_ != nullptr && value_->is_boolean()) return value_->get<bool>();
  FailExpected("true or false");
  return false;
}

std::string JsonReader::String() const {
  if (IsString()) return value_->get<std::string>();
  FailExpected("a string");
  return "";
}

Vector2<double> JsonReader::Point() const {
  if (Size() != 2) {
    FailExpected("an array of 2 numbers [x, y]");
    return {0.0, 0.0};
  }
  const double x = At(0).Number();
  const double y = At(1).Number();
  return {x, y};
}

VectorX<double> JsonReader::Vector() const {
  const int size = ExpectArray("an array of numbers");
  VectorX<double> vector(size);
  for (int i = 0; i < size; ++i) vector[i] = At(i).Number();
  return vector;
}

MatrixX<double> JsonReader::Matrix() const {
  const int rows = ExpectArray("an array of rows");
  const int columns = rows == 0 ? 0 : At(0).Size();
  MatrixX<double> matrix(rows, columns);
  for (int i = 0; i < rows; ++i) {
    const JsonReader row = At(i);
    if (!row.IsArray() || row.Size() != columns) {
      row.FailExpected("a row of " + std::to_string(columns) + " numbers");
      return MatrixX<double>::Zero(rows, columns);
    }
    for (int j = 0; j < columns; ++j) matrix(i, j) = row.At(j).Number();
  }
  return matrix;
}

int JsonReader::Choice(const std::vector<std::string>& names) const {
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (IsString() && value_->get_ref<const std::string&>() == names[i]) return static_cast<int>(i);
  }
  FailExpected("one of " + Join(names));
  return 0;
}

}  // namespace tangible
