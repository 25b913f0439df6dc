// What a URI in a scene file may name: data: payloads, and files in the scene's folder.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "render/gltf/files.h"

namespace carpool::render::gltf {

bool IsDataUri(std::string_view uri);

/// DecodeDataUri() returns the payload, base64 or percent-encoded.
std::vector<std::byte> DecodeDataUri(std::string_view uri, const std::string& where,
                                     ByteBudget& budget);

/// PercentDecode() replaces %XX; what is no valid escape stays as it is, since exporters write raw
/// names.
std::string PercentDecode(std::string_view text);

/// ResolveUri() returns the file that `uri` names. Throws InputError for other schemes and, unless
/// `allow_outside`, for everything that is not inside `folder` once `..` and links are resolved.
std::filesystem::path ResolveUri(const std::filesystem::path& folder, std::string_view uri,
                                 bool allow_outside, const std::string& where);

/// Quoted(), for messages: a URI cut to a readable length, without control characters.
std::string Quoted(std::string_view text);

}  // namespace carpool::render::gltf
