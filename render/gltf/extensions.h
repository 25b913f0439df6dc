// Which extensions the import understands, and what happens to a file that names others.
#pragma once

#include <string>

namespace carpool::render::gltf {

struct Document;

bool IsSupportedExtension(const std::string& name);

/// CheckExtensions() throws InputError for a required extension that is not supported, and warns
/// once of each optional one.
void CheckExtensions(Document& document);

}  // namespace carpool::render::gltf
