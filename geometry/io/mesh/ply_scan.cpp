// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/mesh/mesh_scan.h"

namespace holdfast {
namespace {

constexpr const char* kExportAgain = "Check the file, or export it again";
constexpr std::string_view kStrips = "tristrips";

enum class Type { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat, kDouble };

std::optional<Type> ParseType(std::string_view word) {
  if (word == "char" || word == "int8") return Type::kInt8;
  if (word == "uchar" || word == "uint8") return Type::kUint8;
  if (word == "short" || word == "int16") return Type::kInt16;
  if (word == "ushort" || word == "uint16") return Type::kUint16;
  if (word == "int" || word == "int32") return Type::kInt32;
  if (word == "uint" || word == "uint32") return Type::kUint32;
  if (word == "float" || word == "float32") return Type::kFloat;
  if (word == "double" || word == "float64") return Type::kDouble;
  return std::nullopt;
}

std::size_t Size(Type type) {
  constexpr std::size_t kSizes[] = {1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<int>(type)];
}

struct Property {
  std::string name;
  Type type = Type::kFloat;
  std::optional<Type> count_type;  // a list
};

struct Element {
  std::string name;
  std::size_t count = 0;
  std::vector<Property> properties;
};

class PlyScanner {
 public:
  PlyScanner(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(name) {}

  MeshScan Scan() {
    ReadHeader();
    CheckHeader();
    bool vertices_seen = false;
    for (const Element& element : elements_) {
      if (element.name == "vertex") {
        ReadVertices(element);
        vertices_seen = true;
      } else if (element.name == "face" || element.name == kStrips) {
        if (!vertices_seen) Fail("has its faces before its vertices", kExportAgain);
        element.name == kStrips ? ReadStrips(element) : ReadFaces(element);
      } else {
        for (std::size_t i = 0; i < element.count; ++i) {
          for (const Property& property : element.properties) Skip(property, element.name);
        }
      }
    }
    return std::move(scan_);
  }

 private:
  [[noreturn]] void Fail(const std::string& problem, const std::string& remedy) const {
    throw Error(name_, problem, remedy);
  }

  std::string_view Line() {
    if (position_ >= bytes_.size()) Fail("ends within its header", kTruncated);
    // A header is short text: a "line" of megabytes is something else. Some writers end its lines
    // with a lone carriage return; the first line decides, since numbers may follow the last.
    const std::string_view ahead = bytes_.substr(position_, 4096);
    if (line_end_ == '\0') {
      const std::size_t first = ahead.find_first_of("\r\n");
      line_end_ = ahead.substr(std::min(first, ahead.size())).starts_with("\r") &&
                          ahead.substr(first, 2) != "\r\n"
                      ? '\r'
                      : '\n';
    }
    const std::size_t end = ahead.find(line_end_);
    if (end == std::string_view::npos) Fail("its header is not lines of text", kExportAgain);
    std::string_view line = bytes_.substr(position_, end);
    position_ += end + 1;
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    return line;
  }

  static std::vector<std::string> Words(std::string_view line) {
    std::vector<std::string> words;
    std::size_t at = 0;
    while ((at = line.find_first_not_of(" \t", at)) != std::string_view::npos) {
      const std::size_t end = std::min(line.find_first_of(" \t", at), line.size());
      words.emplace_back(line.substr(at, end - at));
      at = end;
    }
    return words;
  }

  void ReadHeader() {
    if (bytes_.substr(0, 3) != "ply" && bytes_.substr(0, 3) != "PLY") {
      Fail("does not start with 'ply'", "Check that it is a .ply file");
    }
    Line();
    bool has_format = false;
    for (;;) {
      const std::vector<std::string> words = Words(Line());
      if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
      if (words[0] == "end_header") break;
      if (words[0] == "format" && words.size() >= 2) {
        has_format = true;
        is_text_ = words[1] == "ascii";
        is_big_endian_ = words[1] == "binary_big_endian";
        if (!is_text_ && !is_big_endian_ && words[1] != "binary_little_endian") {
          Fail("its header names an unknown format", kExportAgain);
        }
      } else if (words[0] == "element" && words.size() == 3) {
        Element element;
        element.name = words[1];
        const char* end = words[2].data() + words[2].size();
        const auto [parsed, error] = std::from_chars(words[2].data(), end, element.count);
        if (error != std::errc() || parsed != end) {
          Fail(fmt::format("its header does not give the number of '{}' elements",
                           element.name.substr(0, 32)),
               kExportAgain);
        }
        elements_.push_back(std::move(element));
      } else if (words[0] == "property" && words.size() >= 3 && !elements_.empty()) {
        Property property;
        property.name = words.back();
        const bool list = words[1] == "list";
        if (words.size() != (list ? 5u : 3u))
          Fail("its header has a property of an unknown form", kExportAgain);
        const std::optional<Type> type = ParseType(list ? words[3] : words[1]);
        if (list) property.count_type = ParseType(words[2]);
        if (!type || (list && (!property.count_type || *property.count_type >= Type::kFloat))) {
          Fail(fmt::format("its header has a property '{}' of an unknown type",
                           property.name.substr(0, 32)),
               kExportAgain);
        }
        property.type = *type;
        elements_.back().properties.push_back(std::move(property));
      } else {
        Fail("its header has a line that is none of format, element, property, comment",
             kExportAgain);
      }
    }
    if (!has_format) Fail("its header names no format", kExportAgain);
  }

  static bool IsCornerList(const Property& property) {
    return property.count_type &&
           (property.name == "vertex_indices" || property.name == "vertex_index");
  }

  void CheckHeader() {
    std::size_t least_bytes = 0;
    const std::size_t left = bytes_.size() - position_;
    for (const Element& element : elements_) {
      std::size_t each = 0;
      for (const Property& property : element.properties) {
        each += is_text_ ? 2 : Size(property.count_type.value_or(property.type));
      }
      if (each == 0 && element.count > 0) {
        Fail("its header has an element without properties", kExportAgain);
      }
      if (element.count > left || element.count * each > left - std::min(left, least_bytes) + 1 ||
          element.count > std::numeric_limits<int>::max() / 4) {
        Fail(fmt::format("its header promises {} '{}' elements, more than its {} bytes can hold",
                         element.count, element.name.substr(0, 32), bytes_.size()),
             kTruncated);
      }
      least_bytes += element.count * each;
    }
    const auto count = [&](std::string_view name) {
      std::size_t times = 0, elements = 0;
      for (const Element& element : elements_) {
        if (element.name != name) continue;
        elements = element.count;
        if (++times > 1) {
          Fail(fmt::format("its header has the element '{}' twice", name), kExportAgain);
        }
      }
      return elements;
    };
    const bool no_vertices = count("vertex") == 0;
    if (count("face") + count(kStrips) == 0 || no_vertices) {
      Fail(fmt::format("has no {}", no_vertices ? "vertices" : "faces"),
           "Give a surface: vertices, and faces that join them");
    }
  }

  std::string_view Word() {
    while (position_ < bytes_.size() &&
           std::isspace(static_cast<unsigned char>(bytes_[position_]))) {
      ++position_;
    }
    const std::size_t begin = position_;
    while (position_ < bytes_.size() &&
           !std::isspace(static_cast<unsigned char>(bytes_[position_]))) {
      ++position_;
    }
    return bytes_.substr(begin, position_ - begin);
  }

  template <typename T>
  T Raw() {
    T value;
    std::memcpy(&value, bytes_.data() + position_, sizeof value);
    position_ += sizeof value;
    if (is_big_endian_ == (std::endian::native == std::endian::little)) {
      auto* raw = reinterpret_cast<unsigned char*>(&value);
      std::reverse(raw, raw + sizeof value);
    }
    return value;
  }

  double Value(Type type, const std::string& element) {
    if (is_text_) {
      std::string_view word = Word();
      if (word.empty()) Fail(fmt::format("ends within its '{}' elements", element), kTruncated);
      const std::string_view shown = word.substr(0, 32);
      if (word.front() == '+') word.remove_prefix(1);
      double value = 0.0;
      const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
      if (end != word.data() + word.size() || error == std::errc::invalid_argument) {
        std::string printable(shown);
        for (char& c : printable) c = c >= ' ' && c < 127 ? c : '?';
        Fail(fmt::format("has '{}' where a number of a '{}' element should be", printable, element),
             kExportAgain);
      }
      if (error == std::errc::result_out_of_range) {
        return word.find_first_of("eE") != word.npos && word.find("e-") == word.npos &&
                       word.find("E-") == word.npos
                   ? std::numeric_limits<double>::infinity()
                   : 0.0;
      }
      return value;
    }
    if (bytes_.size() - position_ < Size(type)) {
      Fail(fmt::format("ends within its '{}' elements", element), kTruncated);
    }
    switch (type) {
      case Type::kInt8:
        return Raw<std::int8_t>();
      case Type::kUint8:
        return Raw<std::uint8_t>();
      case Type::kInt16:
        return Raw<std::int16_t>();
      case Type::kUint16:
        return Raw<std::uint16_t>();
      case Type::kInt32:
        return Raw<std::int32_t>();
      case Type::kUint32:
        return Raw<std::uint32_t>();
      case Type::kFloat:
        return Raw<float>();
      default:
        return Raw<double>();
    }
  }

  std::size_t ListLength(const Property& property, const std::string& element) {
    const double length = Value(*property.count_type, element);
    const std::size_t each = is_text_ ? 2 : Size(property.type);
    if (!(length >= 0.0) || length != std::floor(length) ||
        length > static_cast<double>((bytes_.size() - position_ + 1) / each)) {
      Fail(fmt::format("a list of a '{}' element is longer than the file", element), kTruncated);
    }
    return static_cast<std::size_t>(length);
  }

  void Skip(const Property& property, const std::string& element) {
    const std::size_t values = property.count_type ? ListLength(property, element) : 1;
    for (std::size_t i = 0; i < values; ++i) Value(property.type, element);
  }

  void ReadVertices(const Element& element) {
    int axes = 0;
    for (const Property& property : element.properties) {
      axes += !property.count_type &&
              (property.name == "x" || property.name == "y" || property.name == "z");
    }
    if (axes != 3) Fail("its vertices do not have the properties x, y and z", kExportAgain);
    scan_.positions.reserve(element.count);
    for (std::size_t v = 0; v < element.count; ++v) {
      Eigen::Vector3d p = Eigen::Vector3d::Zero();
      for (const Property& property : element.properties) {
        if (property.count_type) {
          Skip(property, element.name);
          continue;
        }
        const double value = Value(property.type, element.name);
        const int axis = property.name == "x"   ? 0
                         : property.name == "y" ? 1
                         : property.name == "z" ? 2
                                                : -1;
        if (axis >= 0) p[axis] = value;
      }
      // Meshes are written in single precision, which limits the range.
      if (!p.cast<float>().allFinite()) {
        Fail(fmt::format("vertex {} has a coordinate that is not finite", v),
             "Remove the vertex, or export the mesh again");
      }
      scan_.positions.push_back(p);
    }
  }

  // Calls visit(item, property) for the list of corners of each item, and skips what else it has.
  template <typename Visit>
  void ForEachCornerList(const Element& element, std::string_view items, const Visit& visit) {
    if (std::ranges::count_if(element.properties, IsCornerList) != 1) {
      Fail(fmt::format("its {} do not have one list property vertex_indices", items), kExportAgain);
    }
    scan_.polygon_begin.reserve(element.count + 1);
    scan_.polygon_ids.reserve(3 * element.count);
    for (std::size_t i = 0; i < element.count; ++i) {
      for (const Property& property : element.properties) {
        if (IsCornerList(property)) {
          visit(i, property);
        } else {
          Skip(property, element.name);
        }
      }
    }
  }

  int Corner(double id, std::string_view item, std::size_t index) const {
    if (!(id >= 0.0) || id != std::floor(id) || id >= static_cast<double>(scan_.positions.size())) {
      Fail(fmt::format("{} {} refers to vertex {} of {} (counted from 0)", item, index, id,
                       scan_.positions.size()),
           kExportAgain);
    }
    return static_cast<int>(id);
  }

  void ReadFaces(const Element& element) {
    ForEachCornerList(element, "faces", [&](std::size_t f, const Property& property) {
      const std::size_t corners = ListLength(property, element.name);
      if (corners < 3) {
        Fail(fmt::format("face {} has fewer than three corners", f),
             "Remove it, or export the mesh again");
      }
      for (std::size_t k = 0; k < corners; ++k) {
        scan_.polygon_ids.push_back(Corner(Value(property.type, element.name), "face", f));
      }
      scan_.polygon_begin.push_back(static_cast<int>(scan_.polygon_ids.size()));
    });
  }

  // Triangle strips: from the third corner on, each forms a triangle with the two before it, every
  // second one with reversed orientation; -1 begins another strip.
  void ReadStrips(const Element& element) {
    ForEachCornerList(element, "strips", [&](std::size_t s, const Property& property) {
      int length = 0;
      std::array<int, 2> before = {-1, -1};
      for (std::size_t left = ListLength(property, element.name); left > 0; --left) {
        const double id = Value(property.type, element.name);
        if (id == -1.0) {
          length = 0;
          continue;
        }
        const int corner = Corner(id, "strip", s);
        const auto [a, b] = before;
        // Triangles that repeat a corner only turn the strip: they have no area.
        if (++length >= 3 && a != b && b != corner && corner != a) {
          const bool turned = length % 2 == 0;
          scan_.polygon_ids.insert(scan_.polygon_ids.end(),
                                   {turned ? b : a, turned ? a : b, corner});
          scan_.polygon_begin.push_back(static_cast<int>(scan_.polygon_ids.size()));
        }
        before = {before[1], corner};
      }
    });
  }

  std::string_view bytes_;
  std::string name_;
  std::size_t position_ = 0;
  char line_end_ = '\0';  // of the header
  bool is_text_ = true, is_big_endian_ = false;
  std::vector<Element> elements_;
  MeshScan scan_;
};

}  // namespace

MeshScan ScanPly(std::string_view bytes, const std::string& name) {
  return PlyScanner(bytes, name).Scan();
}

}  // namespace holdfast
