// SPDX-License-Identifier: MIT
#include "geometry/io/container/safetensors.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <fstream>
#include <set>
#include <tuple>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/data_store.h"
#include "geometry/io/container/npy_header.h"
#include "geometry/io/container/text_scanner.h"

namespace holdfast {
namespace {

constexpr std::size_t kLengthBytes = 8;
constexpr std::string_view kMetadataName = "__metadata__";
constexpr std::size_t kTensorsInMessage = 40;

constexpr std::pair<std::string_view, ElementType> kElementWords[] = {
    {"F64", {'f', 8}}, {"F32", {'f', 4}}, {"F16", {'f', 2}}, {"BF16", {'B', 2}}, {"I64", {'i', 8}},
    {"I32", {'i', 4}}, {"I16", {'i', 2}}, {"I8", {'i', 1}},  {"U64", {'u', 8}},  {"U32", {'u', 4}},
    {"U16", {'u', 2}}, {"U8", {'u', 1}},  {"BOOL", {'b', 1}}};

const ElementType* FindElement(std::string_view word) {
  for (const auto& [known, element] : kElementWords) {
    if (word == known) return &element;
  }
  return nullptr;
}

Error Malformed(const std::string& where, std::string_view problem) {
  return Error(where, fmt::format("is a malformed safetensors file ({})", problem),
               "Copy or save it again");
}

// Extracts the header's entries during parsing: {"name": {"dtype": "F32", "shape": [2, 3],
// "data_offsets": [0, 24]}, ..., "__metadata__": {"key": "text"}}. Anything else ends the parsing.
class HeaderHandler : public nlohmann::json_sax<nlohmann::json> {
 public:
  HeaderHandler(std::vector<SafetensorsEntry>& entries, SafetensorsMetadata& metadata)
      : entries_(entries), metadata_(metadata) {}

  const std::string& Problem() const { return problem_; }

  bool null() override { return Refuse("a null"); }
  bool boolean(bool) override { return Refuse("true or false"); }
  bool number_integer(number_integer_t) override { return Refuse("a negative number"); }
  bool number_float(number_float_t, const string_t&) override { return Refuse("a fraction"); }
  bool binary(binary_t&) override { return Refuse("binary data"); }

  bool number_unsigned(number_unsigned_t value) override {
    if (place_ != Place::kNumbers) return Refuse("a number");
    if (field_ == "shape") {
      if (entries_.back().shape.size() == kMaxRank) return Refuse("more than 32 dimensions");
      entries_.back().shape.push_back(static_cast<std::size_t>(value));
    } else {
      if (num_offsets_ == 2) return Refuse("more than two offsets");
      (num_offsets_++ == 0 ? entries_.back().begin : entries_.back().end) = value;
    }
    return true;
  }

  bool string(string_t& text) override {
    if (place_ == Place::kMetadata) {
      metadata_[field_] = std::move(text);
      return true;
    }
    if (place_ != Place::kTensor || field_ != "dtype") return Refuse("a text");
    entries_.back().dtype = std::move(text);
    return true;
  }

  bool start_object(std::size_t) override {
    if (place_ == Place::kOutside) {
      place_ = Place::kHeader;
    } else if (place_ == Place::kHeader && name_ == kMetadataName) {
      if (std::exchange(has_metadata_, true)) return Refuse("two metadata");
      place_ = Place::kMetadata;
    } else if (place_ == Place::kHeader) {
      entries_.push_back({std::move(name_), {}, {}, 0, 0});
      place_ = Place::kTensor;
      seen_.clear();
      num_offsets_ = 0;
    } else {
      return Refuse("an object");
    }
    return true;
  }

  bool end_object() override {
    if (place_ == Place::kTensor && (seen_.size() != 3 || num_offsets_ != 2)) {
      return Refuse("dtype, shape or data_offsets missing", entries_.back().name);
    }
    place_ = place_ == Place::kHeader ? Place::kOutside : Place::kHeader;
    return true;
  }

  bool start_array(std::size_t) override {
    if (place_ != Place::kTensor || field_ == "dtype") return Refuse("a list");
    place_ = Place::kNumbers;
    return true;
  }

  bool end_array() override {
    place_ = Place::kTensor;
    return true;
  }

  bool key(string_t& name) override {
    if (place_ == Place::kHeader) {
      name_ = std::move(name);
      return true;
    }
    field_ = std::move(name);
    if (place_ == Place::kMetadata) {
      return !metadata_.contains(field_) || Refuse("a name twice in the metadata", field_);
    }
    if (field_ != "dtype" && field_ != "shape" && field_ != "data_offsets") {
      return Refuse("an unknown field", field_);
    }
    return seen_.insert(field_).second || Refuse("a field twice", field_);
  }

  bool parse_error(std::size_t position, const std::string&,
                   const nlohmann::detail::exception&) override {
    return Refuse(fmt::format("no JSON at byte {}", position));
  }

 private:
  enum class Place { kOutside, kHeader, kMetadata, kTensor, kNumbers };

  bool Refuse(std::string_view problem, std::string_view name = {}) {
    problem_ = name.empty() ? fmt::format("{} in its header", problem)
                            : fmt::format("{} in its header: '{}'", problem, name.substr(0, 80));
    return false;
  }

  std::vector<SafetensorsEntry>& entries_;
  SafetensorsMetadata& metadata_;
  std::string problem_;
  Place place_ = Place::kOutside;
  std::string name_;   // of the tensor
  std::string field_;  // of the tensor, or of the metadata
  bool has_metadata_ = false;
  std::set<std::string> seen_;  // fields of the tensor
  int num_offsets_ = 0;
};

}  // namespace

SafetensorsReader::SafetensorsReader(const std::filesystem::path& path)
    : SafetensorsReader(ByteSource(path)) {}

SafetensorsReader::SafetensorsReader(ByteSource source) : source_(std::move(source)) {
  const std::string& where = source_.Name();
  std::array<std::byte, kLengthBytes> length{};
  source_.ReadAt(0, length);
  const auto header_bytes = std::bit_cast<std::uint64_t>(length);
  static_assert(std::endian::native == std::endian::little);
  if (header_bytes > kMaxHeaderBytes || header_bytes > source_.Size() - kLengthBytes) {
    throw Error(where,
                fmt::format("is not a safetensors file, or is cut short (its first eight bytes "
                            "state a header of {} bytes)",
                            header_bytes),
                "Give a .safetensors file; copy or save it again");
  }
  data_offset_ = kLengthBytes + header_bytes;
  std::string header(static_cast<std::size_t>(header_bytes), '\0');
  source_.ReadAt(kLengthBytes, std::as_writable_bytes(std::span(header)));
  if (!header.starts_with('{')) throw Malformed(where, "its header does not begin with '{'");
  HeaderHandler handler(entries_, metadata_);
  if (!nlohmann::json::sax_parse(header, &handler)) throw Malformed(where, handler.Problem());
  CheckLayout();
}

void SafetensorsReader::CheckLayout() {
  const std::string& where = source_.Name();
  const std::uint64_t data_bytes = source_.Size() - data_offset_;
  std::sort(entries_.begin(), entries_.end(), [](const auto& a, const auto& b) {
    return std::tie(a.begin, a.end) < std::tie(b.begin, b.end);
  });
  std::uint64_t reached = 0;
  for (const SafetensorsEntry& entry : entries_) {
    const std::string at = fmt::format("{}[{}]", where, entry.name);
    if (entry.end < entry.begin || entry.end > data_bytes) {
      throw Error(at,
                  fmt::format("lies at bytes {} to {} of {}: the file is cut off or damaged",
                              entry.begin, entry.end, data_bytes),
                  "Copy or save it again");
    }
    if (entry.begin < reached) throw Malformed(at, "it overlaps another tensor");
    if (entry.begin > reached) throw Malformed(at, "a gap before it");
    reached = entry.end;
    const ElementType* element = FindElement(entry.dtype);
    if (element == nullptr) continue;  // other tensors may still be usable
    if (CheckedProduct(entry.shape, element->size) != entry.end - entry.begin) {
      throw Malformed(
          at, fmt::format("shape ({}) of {} does not fit its {} bytes",
                          fmt::join(entry.shape, ", "), entry.dtype, entry.end - entry.begin));
    }
  }
  if (reached != data_bytes) {
    throw Malformed(where, fmt::format("{} bytes after the last tensor", data_bytes - reached));
  }
  std::ranges::sort(entries_, {}, &SafetensorsEntry::name);
  const auto twice = std::ranges::adjacent_find(entries_, {}, &SafetensorsEntry::name);
  if (twice != entries_.end()) {
    throw Malformed(where, fmt::format("'{}' appears twice", twice->name));
  }
}

const SafetensorsEntry* SafetensorsReader::Find(std::string_view name) const {
  const auto at = std::ranges::lower_bound(entries_, name, {}, &SafetensorsEntry::name);
  return at == entries_.end() || at->name != name ? nullptr : &*at;
}

std::vector<std::string> SafetensorsReader::Names() const {
  std::vector<std::string> names;
  names.reserve(entries_.size());
  for (const SafetensorsEntry& entry : entries_) names.push_back(entry.name);
  return names;
}

NpyMember SafetensorsReader::Read(std::string_view name) const {
  const std::string where = fmt::format("{}[{}]", source_.Name(), name);
  const SafetensorsEntry* entry = Find(name);
  if (entry == nullptr) {
    throw Error(where, "is missing",
                fmt::format("The file has: {}", SomeNames(Names(), kTensorsInMessage)));
  }
  const ElementType* element = FindElement(entry->dtype);
  if (element == nullptr) {
    throw Error(where, fmt::format("has elements of type '{}', which are not read", entry->dtype),
                "Save it as float32, float16 or bfloat16");
  }
  NpyMember member{where, NpyArray{element->kind, element->size, false, false, entry->shape, {}}};
  const auto bytes = static_cast<std::size_t>(entry->end - entry->begin);
  const std::uint64_t offset = data_offset_ + entry->begin;
  if (element->kind != 'B') {
    member.array.data.resize(bytes);
    source_.ReadAt(offset, member.array.data);
    return member;
  }
  // A bfloat16 is the upper half of a float. Read the halves to the end of the buffer and expand
  // them from the front: no float overwrites a half that is still needed.
  member.array.kind = 'f';
  member.array.item_size = 4;
  member.array.data.resize(2 * bytes);
  const std::span<std::byte> data(member.array.data);
  source_.ReadAt(offset, data.last(bytes));
  for (std::size_t i = 0; i < bytes; i += 2) {
    const std::array<std::byte, 2> half{data[bytes + i], data[bytes + i + 1]};
    data[2 * i] = data[2 * i + 1] = std::byte{0};
    data[2 * i + 2] = half[0];
    data[2 * i + 3] = half[1];
  }
  return member;
}

bool SafetensorsReader::Recognizes(std::string_view head, std::uint64_t file_bytes) {
  if (head.size() < kLengthBytes + 2) return false;
  const std::uint64_t header_bytes = FromLittleEndian(head.substr(0, kLengthBytes));
  return head[kLengthBytes] == '{' && header_bytes >= 2 && header_bytes <= kMaxHeaderBytes &&
         header_bytes <= file_bytes - kLengthBytes;
}

void SafetensorsWriter::AddFloat32(std::string name, std::vector<std::size_t> shape,
                                   std::span<const float> values) {
  Add(std::move(name), MakeNpyArray('f', std::move(shape), values));
}

void SafetensorsWriter::AddFloat64(std::string name, std::vector<std::size_t> shape,
                                   std::span<const double> values) {
  Add(std::move(name), MakeNpyArray('f', std::move(shape), values));
}

void SafetensorsWriter::AddFloat16(std::string name, std::vector<std::size_t> shape,
                                   std::span<const float> values) {
  const std::vector<std::uint16_t> halves = ToHalves(values, name, "16 bits");
  Add(std::move(name), MakeNpyArray('f', std::move(shape), halves));
}

void SafetensorsWriter::AddInt64(std::string name, std::vector<std::size_t> shape,
                                 std::span<const std::int64_t> values) {
  Add(std::move(name), MakeNpyArray('i', std::move(shape), values));
}

void SafetensorsWriter::Add(std::string name, NpyArray array) {
  const bool numbers = std::string_view("fiub").find(array.kind) != std::string_view::npos;
  if (!numbers || (array.big_endian && array.item_size > 1) ||
      (array.fortran_order && array.shape.size() > 1)) {
    throw Error(name, "is not an array of numbers in C order and little-endian",
                "Convert it first");
  }
  if (array.item_size * array.NumElements() != array.data.size()) {
    throw Error(name,
                fmt::format("has {} values for shape ({})", array.data.size() / array.item_size,
                            fmt::join(array.shape, ", ")),
                "Give as many as the shape asks for");
  }
  if (name.empty() || name == kMetadataName) {
    throw Error(fmt::format("'{}'", name), "is not a valid tensor name", "Choose another name");
  }
  tensors_.insert_or_assign(std::move(name), std::move(array));
}

void SafetensorsWriter::Write(const std::filesystem::path& path) const {
  std::vector<const std::pair<const std::string, NpyArray>*> order;
  for (const auto& tensor : tensors_) order.push_back(&tensor);
  std::stable_sort(order.begin(), order.end(), [](const auto* a, const auto* b) {
    return a->second.item_size > b->second.item_size;
  });
  nlohmann::ordered_json header = nlohmann::ordered_json::object();
  if (!metadata_.empty()) header["__metadata__"] = metadata_;
  std::size_t reached = 0;
  for (const auto* tensor : order) {
    const auto& [name, array] = *tensor;
    const std::size_t end = reached + array.data.size();
    const char letter = array.kind == 'f' ? 'F' : array.kind == 'i' ? 'I' : 'U';
    header[name] = {
        {"dtype", array.kind == 'b' ? "BOOL" : fmt::format("{}{}", letter, 8 * array.item_size)},
        {"shape", array.shape},
        {"data_offsets", {reached, end}}};
    reached = end;
  }
  std::string text;
  try {
    text = header.dump();
  } catch (const nlohmann::json::exception&) {
    throw Error(path.string(), "has a name or metadata that are not UTF-8", "Use other names");
  }
  text.append((8 - text.size() % 8) % 8, ' ');  // aligns the tensors
  if (text.size() > SafetensorsReader::kMaxHeaderBytes) {
    throw Error(path.string(), "would have a header beyond the format's limit", "Split the file");
  }
  WriteAtomically(path, [&](const std::filesystem::path& temporary) {
    std::ofstream out(temporary, std::ios::binary);
    const auto length = std::bit_cast<std::array<char, 8>>(std::uint64_t{text.size()});
    out.write(length.data(), length.size());
    out.write(text.data(), static_cast<std::streamsize>(text.size()));
    for (const auto* tensor : order) {
      const std::vector<std::byte>& data = tensor->second.data;
      out.write(reinterpret_cast<const char*>(data.data()),
                static_cast<std::streamsize>(data.size()));
    }
    out.close();
    if (!out) {
      throw Error(path.string(), "could not be written",
                  "Free some space or choose another folder");
    }
  });
}

}  // namespace holdfast
