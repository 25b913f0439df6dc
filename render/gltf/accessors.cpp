// Accessors: extents checked in 64 bits before a byte is read, then one loop per component type.
#include "render/gltf/accessors.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <type_traits>

namespace carpool::render::gltf {
namespace {

constexpr int kByte = 5120, kUnsignedByte = 5121, kShort = 5122, kUnsignedShort = 5123,
              kUnsignedInt = 5125;

uint64_t ComponentSize(int type) {
  if (type == kByte || type == kUnsignedByte) return 1;
  return type == kShort || type == kUnsignedShort ? 2 : 4;
}

/// Rows and columns of an accessor's type; vectors have one column.
struct Dimensions {
  int rows, columns;
};

Dimensions ReadDimensions(const std::string& type) {
  if (type == "SCALAR") return {1, 1};
  const int n = type[3] - '0';
  return type[0] == 'V' ? Dimensions{n, 1} : Dimensions{n, n};
}

/// Matrix columns start at multiples of 4 bytes.
uint64_t ColumnSize(const Dimensions& dimensions, int component_type) {
  const uint64_t bytes = dimensions.rows * ComponentSize(component_type);
  return dimensions.columns == 1 ? bytes : (bytes + 3) / 4 * 4;
}

template <typename T>
float Convert(T value, bool normalized) {
  if constexpr (std::is_same_v<T, float>) {
    return value;
  } else {
    if (!normalized) return static_cast<float>(value);
    const float scaled =
        static_cast<float>(value) / static_cast<float>(std::numeric_limits<T>::max());
    return std::max(scaled, -1.0f);  // the most negative integer maps to -1 as well
  }
}

/// Calls `visit` with a value of the C++ type of a component type.
template <typename Visitor>
auto VisitType(int type, Visitor visit) {
  switch (type) {
    case kByte:
      return visit(int8_t{});
    case kUnsignedByte:
      return visit(uint8_t{});
    case kShort:
      return visit(int16_t{});
    case kUnsignedShort:
      return visit(uint16_t{});
    case kUnsignedInt:
      return visit(uint32_t{});
    default:
      return visit(float{});
  }
}

/// Where the components of one element lie, relative to its start.
struct Element {
  int count;
  int rows;
  uint64_t column_size;

  uint64_t Offset(int component, uint64_t component_size) const {
    return component / rows * column_size + component % rows * component_size;
  }
};

void ConvertElement(const std::byte* from, const Element& element, int type, bool normalized,
                    float* to) {
  VisitType(type, [&](auto tag) {
    using T = decltype(tag);
    for (int c = 0; c < element.count; ++c) {
      T value;
      std::memcpy(&value, from + element.Offset(c, sizeof(T)), sizeof(T));
      to[c] = Convert(value, normalized);
    }
  });
}

Element ElementOf(const AccessorLayout& layout, const Json& json) {
  const Dimensions dimensions = ReadDimensions(json["type"]);
  return {layout.components, dimensions.rows, ColumnSize(dimensions, layout.component_type)};
}

/// Bytes [offset, offset + extent) of a buffer view, or an error at `pointer`. The schema keeps
/// every number below 2^53, so that the sums here cannot wrap.
const std::byte* Locate(const Document& document, int view, uint64_t offset, uint64_t extent,
                        const std::string& pointer) {
  const std::span<const std::byte> bytes = BufferViewBytes(document, view);
  if (offset + extent > bytes.size()) {
    document.Fail(pointer, "reads " + std::to_string(offset + extent) + " bytes of buffer view " +
                               std::to_string(view) + ", which has " +
                               std::to_string(bytes.size()) + "; export the file again");
  }
  return bytes.data() + offset;
}

uint32_t ReadUnsigned(const std::byte* from, int type) {
  return VisitType(type, [from](auto tag) {
    decltype(tag) value;
    std::memcpy(&value, from, sizeof value);
    return static_cast<uint32_t>(value);
  });
}

/// The overriding elements of a sparse accessor, checked.
struct SparsePart {
  std::vector<uint32_t> indices;
  const std::byte* values = nullptr;
  uint64_t value_size = 0;
};

SparsePart ReadSparse(const Document& document, const AccessorLayout& layout,
                      const Element& element) {
  const Json& sparse = document.Items("accessors")[layout.index]["sparse"];
  const std::string pointer = Pointer("accessors", layout.index, "sparse");
  const uint64_t count = sparse["count"];
  if (count > layout.count)
    document.Fail(pointer + "/count", "is larger than the accessor; export the file again");
  const Json& indices = sparse["indices"];
  const Json& values = sparse["values"];
  const int index_type = indices["componentType"];
  const uint64_t index_size = ComponentSize(index_type);
  SparsePart part;
  part.value_size = element.column_size * (element.count / element.rows);
  const std::byte* from =
      Locate(document, indices["bufferView"], Get<uint64_t>(indices, "byteOffset", 0),
             count * index_size, pointer + "/indices");
  part.values = Locate(document, values["bufferView"], Get<uint64_t>(values, "byteOffset", 0),
                       count * part.value_size, pointer + "/values");
  part.indices.resize(count);
  for (uint64_t i = 0; i < count; ++i) {
    part.indices[i] = ReadUnsigned(from + i * index_size, index_type);
    if (part.indices[i] >= layout.count || (i > 0 && part.indices[i] <= part.indices[i - 1])) {
      document.Fail(pointer + "/indices", "index " + std::to_string(i) + " is " +
                                              std::to_string(part.indices[i]) +
                                              ", out of range or order; export the file again");
    }
  }
  return part;
}

}  // namespace

AccessorLayout ReadLayout(const Document& document, int accessor) {
  const Json& json = document.Items("accessors")[accessor];
  const std::string pointer = Pointer("accessors", accessor);
  const Dimensions dimensions = ReadDimensions(json["type"]);
  AccessorLayout layout;
  layout.index = accessor;
  layout.count = json["count"];
  layout.component_type = json["componentType"];
  layout.components = dimensions.rows * dimensions.columns;
  layout.normalized = Get<bool>(json, "normalized", false);
  layout.sparse = json.contains("sparse");
  const uint64_t size = ColumnSize(dimensions, layout.component_type) * dimensions.columns;
  layout.stride = size;
  if (!json.contains("bufferView")) {
    if (layout.count > kMostImplicitElements) {
      document.Fail(pointer + "/count",
                    std::to_string(layout.count) +
                        " elements without a bufferView are too many; store them in a buffer");
    }
    return layout;
  }
  const int view = json["bufferView"];
  layout.stride = Get<uint64_t>(document.Items("bufferViews")[view], "byteStride", size);
  layout.data = Locate(document, view, Get<uint64_t>(json, "byteOffset", 0),
                       (layout.count - 1) * layout.stride + size, pointer);
  return layout;
}

std::vector<float> ReadFloats(const Document& document, const AccessorLayout& layout,
                              std::optional<std::span<const uint32_t>> elements) {
  const Json& json = document.Items("accessors")[layout.index];
  const Element element = ElementOf(layout, json);
  const uint64_t count = elements ? elements->size() : layout.count;
  std::vector<float> out(count * layout.components, 0.0f);
  const auto source = [&](uint64_t i) { return elements ? (*elements)[i] : i; };
  if (layout.data) {
    for (uint64_t i = 0; i < count; ++i) {
      ConvertElement(layout.data + source(i) * layout.stride, element, layout.component_type,
                     layout.normalized, &out[i * layout.components]);
    }
  }
  if (!layout.sparse) return out;
  const SparsePart part = ReadSparse(document, layout, element);
  for (uint64_t i = 0; i < count; ++i) {
    const auto found = std::lower_bound(part.indices.begin(), part.indices.end(), source(i));
    if (found == part.indices.end() || *found != source(i)) continue;
    ConvertElement(part.values + (found - part.indices.begin()) * part.value_size, element,
                   layout.component_type, layout.normalized, &out[i * layout.components]);
  }
  return out;
}

std::vector<uint32_t> ReadIndices(const Document& document, int accessor) {
  const AccessorLayout layout = ReadLayout(document, accessor);
  const int type = layout.component_type;
  if (layout.components != 1 ||
      (type != kUnsignedByte && type != kUnsignedShort && type != kUnsignedInt)) {
    document.Fail(Pointer("accessors", accessor),
                  "indices must be SCALAR of an unsigned integer type; "
                  "export the file again");
  }
  std::vector<uint32_t> out(layout.count, 0);
  if (layout.data) {
    for (uint64_t i = 0; i < layout.count; ++i)
      out[i] = ReadUnsigned(layout.data + i * layout.stride, type);
  }
  if (layout.sparse) {
    const SparsePart part = ReadSparse(document, layout, {1, 1, ComponentSize(type)});
    for (size_t i = 0; i < part.indices.size(); ++i) {
      out[part.indices[i]] = ReadUnsigned(part.values + i * part.value_size, type);
    }
  }
  return out;
}

}  // namespace carpool::render::gltf
