// A set of small integers that finds its first member in a few instructions, however large it is.
#pragma once

#include <array>
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

  Bitmap() : Bitmap(1) {}
  explicit Bitmap(std::uint32_t size) {
    std::size_t words = size;
    std::size_t all = 0;
    do {
      words = (words + 63) / 64;
      begins_[storeys_++] = static_cast<std::uint32_t>(all);
      all += words;
    } while (words > 1);
    begins_[storeys_] = static_cast<std::uint32_t>(all);
    words_.assign(all, 0);
  }

  void set(std::uint32_t index) {
    for (std::uint32_t storey = 0; storey < storeys_; ++storey, index /= 64) {
      std::uint64_t& word = word_at(storey, index / 64);
      const bool was_empty = word == 0;
      word |= std::uint64_t{1} << (index % 64);
      if (!was_empty) {
        return;  // every storey above knows already
      }
    }
  }

  void clear(std::uint32_t index) {
    for (std::uint32_t storey = 0; storey < storeys_; ++storey, index /= 64) {
      std::uint64_t& word = word_at(storey, index / 64);
      word &= ~(std::uint64_t{1} << (index % 64));
      if (word != 0) {
        return;
      }
    }
  }

  bool test(std::uint32_t index) const { return (words_[index / 64] >> (index % 64) & 1) != 0; }

  bool empty() const { return words_.back() == 0; }

  std::uint32_t first() const { return empty() ? kNone : descend(storeys_, 0); }

  // first_from returns the first member at or above `from`, or else the first of all: a round
  // robin.
  std::uint32_t first_from(std::uint32_t from) const {
    std::uint32_t index = from;
    for (std::uint32_t storey = 0; storey < storeys_; ++storey) {
      const std::uint32_t word = index / 64;
      if (begins_[storey] + word < begins_[storey + 1]) {
        const std::uint64_t rest = word_at(storey, word) & (~std::uint64_t{0} << (index % 64));
        if (rest != 0) {
          return descend(storey, word * 64 + static_cast<std::uint32_t>(std::countr_zero(rest)));
        }
      }
      index = word + 1;  // nothing in this word: go on behind it, one storey up
    }
    return first();
  }

  std::size_t bytes() const { return words_.size() * sizeof(std::uint64_t); }

 private:
  static constexpr std::size_t kMostStoreys = 6;  // enough for 2^32 members

  std::uint64_t& word_at(std::uint32_t storey, std::uint32_t word) {
    return words_[begins_[storey] + word];
  }
  const std::uint64_t& word_at(std::uint32_t storey, std::uint32_t word) const {
    return words_[begins_[storey] + word];
  }

  // descend follows first bits down, from member `index` of a storey or from above the root.
  std::uint32_t descend(std::uint32_t storey, std::uint32_t index) const {
    while (storey > 0) {
      --storey;
      index = index * 64 + static_cast<std::uint32_t>(std::countr_zero(word_at(storey, index)));
    }
    return index;
  }

  std::uint32_t storeys_ = 0;
  std::array<std::uint32_t, kMostStoreys + 1> begins_{};  // the members first, the root last
  std::vector<std::uint64_t> words_;
};

}  // namespace carpool
