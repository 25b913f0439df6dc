// The small values by which a program names the stages and sources of its graph.
#pragma once

#include <cstdint>

namespace carpool {

class Graph;
class Emitter;

/// StageHandle names a stage whose items are of type T. Copy it freely. It is valid for the graph
/// that made it, for as long as that lives; a default-made one names nothing, and emitting to it
/// throws.
template <class T>
class StageHandle {
 public:
  StageHandle() = default;

  std::uint32_t index() const { return index_; }  ///< Position in RunReport::stages.
  std::uint32_t bins() const { return bins_; }    ///< How many bins the stage was given.

 private:
  friend class Graph;
  friend class Emitter;
  StageHandle(std::uint32_t index, std::uint32_t first_slot, std::uint32_t bins)
      : index_(index), first_slot_(first_slot), bins_(bins) {}

  std::uint32_t index_ = 0;
  std::uint32_t first_slot_ = 0;
  std::uint32_t bins_ = 0;  // zero makes every bin out of range
};

/// SourceHandle names a source.
class SourceHandle {
 public:
  SourceHandle() = default;

  std::uint32_t index() const { return index_; }  ///< Position in RunReport::sources.

 private:
  friend class Graph;
  explicit SourceHandle(std::uint32_t index) : index_(index) {}

  std::uint32_t index_ = ~0U;
};

}  // namespace carpool
