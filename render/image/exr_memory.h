// OpenEXR streams over memory. Internal to render/image.
#pragma once

#include <ImfIO.h>

#include <Iex.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <vector>

namespace carpool::render {

/// Collects what OpenEXR writes.
class ExrMemoryOutput : public Imf::OStream {
 public:
  ExrMemoryOutput() : Imf::OStream("memory") {}

  void write(const char c[], int n) override {
    const auto count = static_cast<size_t>(n);
    if (position_ + count > bytes_.size()) bytes_.resize(position_ + count);
    std::memcpy(bytes_.data() + position_, c, count);
    position_ += count;
  }
  uint64_t tellp() override { return position_; }
  void seekp(uint64_t position) override { position_ = static_cast<size_t>(position); }

  std::span<const std::byte> Bytes() const { return bytes_; }

 private:
  std::vector<std::byte> bytes_;
  size_t position_ = 0;
};

/// Reads from a block of memory that outlives it; reading past the end throws.
class ExrMemoryInput : public Imf::IStream {
 public:
  explicit ExrMemoryInput(std::span<const std::byte> bytes)
      : Imf::IStream("memory"), bytes_(bytes) {}

  bool read(char c[], int n) override {
    if (n < 0 || position_ > bytes_.size() || static_cast<size_t>(n) > bytes_.size() - position_) {
      throw IEX_NAMESPACE::InputExc("the file ends too early");
    }
    std::memcpy(c, bytes_.data() + position_, static_cast<size_t>(n));
    position_ += static_cast<size_t>(n);
    return position_ < bytes_.size();
  }
  uint64_t tellg() override { return position_; }
  void seekg(uint64_t position) override { position_ = static_cast<size_t>(position); }

 private:
  std::span<const std::byte> bytes_;
  size_t position_ = 0;
};

}  // namespace carpool::render
