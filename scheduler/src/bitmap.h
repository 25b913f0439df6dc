// A set of small integers that finds its first member in a few instructions, however large it is.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace carpool {

// Bitmap keeps one bit per member and, above it, one bit per non-empty word, and so on up: 64-ary.
// A search reads one word per storey: two for 4,096 members, three for 262,144.
class Bitmap {
 public:
  static constexpr std::uint32_t kNone = ~0U;

  Bitmap() = default;
  explicit Bitmap(std::uint32_t size) {
    std::size_t words = size;
    do {
      words = (words + 63) / 64;
      storeys_.emplace_back(words, 0);
    } while (words > 1);
  }

  void set(std::uint32_t index) {
    for (auto& storey : storeys_) {
      std::uint64_t& word = storey[index / 64];
      const bool was_empty = word == 0;
      word |= std::uint64_t{1} << (index % 64);
      if (!was_empty) {
        return;  // every storey above knows already
      }
      index /= 64;
    }
  }

  void clear(std::uint32_t index) {
    for (auto& storey : storeys_) {
      std::uint64_t& word = storey[index / 64];
      word &= ~(std::uint64_t{1} << (index % 64));
      if (word != 0) {
        return;
      }
      index /= 64;
    }
  }

  bool test(std::uint32_t index) const {
    return (storeys_.front()[index / 64] >> (index % 64) & 1) != 0;
  }

  bool empty() const { return storeys_.empty() || storeys_.back().front() == 0; }

  std::uint32_t first() const { return empty() ? kNone : descend(storeys_.size(), 0); }

  // first_from returns the first member at or above `from`, or else the first of all: a round
  // robin.
  std::uint32_t first_from(std::uint32_t from) const {
    std::uint32_t index = from;
    for (std::size_t storey = 0; storey < storeys_.size(); ++storey) {
      const auto& words = storeys_[storey];
      const std::uint32_t word = index / 64;
      if (word < words.size()) {
        const std::uint64_t rest = words[word] & (~std::uint64_t{0} << (index % 64));
        if (rest != 0) {
          return descend(storey, word * 64 + static_cast<std::uint32_t>(std::countr_zero(rest)));
        }
      }
      index = word + 1;  // nothing in this word: go on behind it, one storey up
    }
    return first();
  }

  std::size_t bytes() const {
    std::size_t words = 0;
    for (const auto& storey : storeys_) {
      words += storey.size();
    }
    return words * sizeof(std::uint64_t);
  }

 private:
  // descend follows first bits down from member `index` of storey `storey` (or from the root word
  // above all).
  std::uint32_t descend(std::size_t storey, std::uint32_t index) const {
    while (storey > 0) {
      --storey;
      index = index * 64 + static_cast<std::uint32_t>(std::countr_zero(storeys_[storey][index]));
    }
    return index;
  }

  std::vector<std::vector<std::uint64_t>> storeys_;  // the members first
};

}  // namespace carpool
