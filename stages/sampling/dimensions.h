// The fixed table of sample dimensions: every random number of a path is named by (vertex,
// purpose).
#pragma once

#include <cstdint>

namespace carpool::stages {

/// What a number is for. Each (vertex, purpose) pair is a dimension, or a pair of dimensions, of
/// its own: an effect that a scene does not use leaves its numbers unused, and no other number
/// moves.
///
/// Vertex 0 is the camera, vertex 1 the first hit, and so on. New purposes take spare numbers;
/// numbers are never reused or shifted, since that would change every image.
enum class Purpose : uint32_t {
  camera_filter = 0,       // 2D: position within the pixel filter
  camera_lens = 1,         // 2D: position on the lens
  camera_time = 2,         // 1D: shutter time
  lobe = 3,                // 1D: which BSDF lobe to sample
  bsdf = 4,                // 2D: direction from that lobe
  light_pick = 5,          // 1D: which light
  light_point = 6,         // 2D: point or direction on it
  roulette = 7,            // 1D: does the path go on
  alpha = 8,               // hashed by layer: is a blended layer hit
  texture_level = 9,       // hashed: between mip levels or texels
  scatter_distance = 10,   // hashed by event: free flight in a volume
  scatter_direction = 11,  // hashed by event: phase function
  scatter_channel = 12,    // hashed by event: colour channel or wavelength
  // 13 to 31 are spare.
};

/// Purposes per vertex. The dimension is vertex x 32 + purpose modulo 2^32: past vertex 2^27
/// dimensions repeat, which no path reaches. Sample numbers are 32-bit: a pixel has at most 2^32
/// samples, 2^30 in each of its four scrambles; whoever counts samples must stop there.
constexpr uint32_t kPurposesPerVertex = 32;
constexpr uint64_t kMaxSamplesPerPixel = uint64_t{1} << 32;

/// Samples belong by index to this many scrambles that are independent of each other.
constexpr uint32_t kScrambleGroups = 4;
constexpr uint32_t ScrambleGroup(uint32_t sample) {
  return sample & (kScrambleGroups - 1);
}

}  // namespace carpool::stages
