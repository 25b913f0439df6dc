// A small rule language for JSON, and the check of a scene file against glTF's rules.
#pragma once

#include <initializer_list>
#include <string>
#include <vector>

namespace carpool::render::gltf {

struct Document;

enum class Type {
  object,
  array,
  string,
  boolean,
  integer,
  number,
  numbers,
  one_of,
  reference,
  references
};

/// One property that a file may have. `path` steps through objects by name and through all members
/// of an array or object by '*'; a parent's rule stands before its children's. Example:
/// {"accessors/*/count", Type::integer, true, 1, 1e9}.
struct Rule {
  std::string path;
  Type type = Type::object;
  bool required = false;
  double least = 0;                     // integer, number, numbers: bounds of each value;
  double most = 0;                      // array: bounds of the length
  size_t length = 0;                    // numbers: how many; 0: any
  std::string target = {};              // reference: the top-level array that is indexed
  std::vector<std::string> words = {};  // one_of: the strings ...
  std::vector<int> values = {};         // ... or integers allowed
};

/// GltfRules() lists the core schema and the supported extensions.
const std::vector<Rule>& GltfRules();

/// CheckSchema() throws InputError at the first property that breaks a rule.
void CheckSchema(const Document& document);

}  // namespace carpool::render::gltf
