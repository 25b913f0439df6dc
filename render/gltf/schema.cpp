// Walks a scene's JSON along each rule's path and checks what it finds there.
#include "render/gltf/schema.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "render/gltf/document.h"

namespace carpool::render::gltf {
namespace {

/// One step of the way to the value under check, kept as a list so that a pointer is only spelled
/// out for a message.
struct Step {
  const Step* parent;
  std::string_view name;
  size_t index;  // used where `name` is empty

  std::string Spell() const {
    std::string out = parent ? parent->Spell() : std::string();
    return out.append("/").append(name.empty() ? std::to_string(index) : Escape(name));
  }

  static std::string Escape(std::string_view name) {
    std::string out;
    for (char c : name.substr(0, 80)) {
      if (c == '~')
        out += "~0";
      else if (c == '/')
        out += "~1";
      else
        out += static_cast<unsigned char>(c) < ' ' ? '?' : c;
    }
    return out;
  }
};

class Checker {
 public:
  Checker(const Document& document, const Rule& rule) : document_(document), rule_(rule) {}

  void Walk(const Json& value, std::string_view path, const Step* here) const;

 private:
  void Check(const Json& value, const Step& here) const;
  void CheckNumber(const Json& value, const Step& here) const;
  void CheckNumbers(const Json& value, const Step& here) const;
  void CheckReference(const Json& value, const Step& here) const;
  void CheckChoice(const Json& value, const Step& here) const;
  [[noreturn]] void Fail(const Step& here, const std::string& what) const {
    document_.Fail(here.Spell(), what + "; correct the file or export it again");
  }

  const Document& document_;
  const Rule& rule_;
};

bool IsInteger(const Json& value) {
  if (value.is_number_integer()) return true;
  // Some exporters write 3.0; anything past 2^53 is no exact integer any more.
  if (!value.is_number_float()) return false;
  const double number = value.get<double>();
  return number == std::floor(number) && std::fabs(number) < 9007199254740992.0;
}

std::string Show(double number) {
  std::string text = std::to_string(number);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return std::fabs(number) < 1e15 ? text : (number < 0 ? "-huge" : "huge");
}

void Checker::Walk(const Json& value, std::string_view path, const Step* here) const {
  if (path.empty()) return Check(value, *here);
  const size_t slash = path.find('/');
  const std::string_view name = path.substr(0, slash);
  const std::string_view rest = slash == std::string_view::npos ? "" : path.substr(slash + 1);
  if (name == "*") {
    size_t index = 0;
    if (value.is_object()) {
      for (const auto& [key, member] : value.items()) {
        const std::string_view shown =
            key.empty() ? std::string_view("(empty)") : std::string_view(key);
        const Step step{here, shown, 0};
        Walk(member, rest, &step);
      }
    } else {
      for (const Json& member : value) {
        const Step step{here, {}, index++};
        Walk(member, rest, &step);
      }
    }
    return;
  }
  const Step step{here, name, 0};
  const auto found = value.find(name);
  if (found != value.end()) return Walk(*found, rest, &step);
  if (rule_.required && rest.empty()) Fail(step, "this property is missing");
}

void Checker::Check(const Json& value, const Step& here) const {
  switch (rule_.type) {
    case Type::object:
      if (!value.is_object()) Fail(here, "must be an object");
      return;
    case Type::array:
      if (!value.is_array()) Fail(here, "must be an array");
      if (static_cast<double>(value.size()) < rule_.least)
        Fail(here, "the array has too few elements");
      if (static_cast<double>(value.size()) > rule_.most)
        Fail(here, "the array has too many elements");
      return;
    case Type::string:
      if (!value.is_string()) Fail(here, "must be a string");
      return;
    case Type::boolean:
      if (!value.is_boolean()) Fail(here, "must be true or false");
      return;
    case Type::integer:
      if (!IsInteger(value)) Fail(here, "must be an integer");
      return CheckNumber(value, here);
    case Type::number:
      return CheckNumber(value, here);
    case Type::numbers:
      return CheckNumbers(value, here);
    case Type::one_of:
      return CheckChoice(value, here);
    case Type::reference:
      return CheckReference(value, here);
    case Type::references:
      if (!value.is_array()) Fail(here, "must be an array");
      for (size_t i = 0; i < value.size(); ++i) CheckReference(value[i], Step{&here, {}, i});
      return;
  }
}

void Checker::CheckNumber(const Json& value, const Step& here) const {
  if (!value.is_number()) Fail(here, "must be a number");
  const double number = value.get<double>();
  if (number < rule_.least || number > rule_.most || !std::isfinite(number)) {
    Fail(here, "is " + Show(number) + " but must be from " + Show(rule_.least) + " to " +
                   Show(rule_.most));
  }
}

void Checker::CheckNumbers(const Json& value, const Step& here) const {
  if (!value.is_array()) Fail(here, "must be an array of numbers");
  if (rule_.length != 0 && value.size() != rule_.length) {
    Fail(here, "must have " + std::to_string(rule_.length) + " numbers");
  }
  for (size_t i = 0; i < value.size(); ++i) CheckNumber(value[i], Step{&here, {}, i});
}

void Checker::CheckReference(const Json& value, const Step& here) const {
  if (!IsInteger(value)) Fail(here, "must be an index");
  const double index = value.get<double>();
  const size_t count = document_.Items(rule_.target.c_str()).size();
  if (index < 0 || index >= static_cast<double>(count)) {
    Fail(here, "refers to " + rule_.target + " " + Show(index) + ", but the file has " +
                   std::to_string(count));
  }
}

void Checker::CheckChoice(const Json& value, const Step& here) const {
  std::string allowed;
  for (const std::string& word : rule_.words) {
    if (value.is_string() && value.get_ref<const std::string&>() == word) return;
    allowed += " '" + word + "'";
  }
  for (int choice : rule_.values) {
    if (IsInteger(value) && value.get<double>() == choice) return;
    allowed.append(" ").append(std::to_string(choice));
  }
  Fail(here, "must be one of" + allowed);
}

}  // namespace

void CheckSchema(const Document& document) {
  if (!document.json.is_object()) document.Fail("/", "must be an object; export the file again");
  for (const Rule& rule : GltfRules())
    Checker(document, rule).Walk(document.json, rule.path, nullptr);
}

}  // namespace carpool::render::gltf
