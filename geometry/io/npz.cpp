// SPDX-License-Identifier: MIT
#include "geometry/io/npz.h"

#include <zip.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/error.h"
#include "geometry/io/atomic_file.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little, "written for little-endian machines");

constexpr std::size_t kMaxHeaderBytes = 1 << 16;
constexpr std::size_t kMaxMemberBytes = std::size_t{16} << 30;
// Deflate cannot expand by more than 1032:1; a member that claims more is lying about its size.
constexpr std::size_t kMaxDeflateRatio = 1040;
constexpr std::string_view kMagic("\x93NUMPY", 6);

// --- the header: a Python dictionary literal of three known entries ---

class HeaderParser {
 public:
  HeaderParser(std::string_view text, const std::string& where) : rest_(text), where_(where) {}

  NpyArray Parse() {
    NpyArray array;
    bool has_descr = false, has_order = false, has_shape = false;
    Expect('{');
    while (!Accept('}')) {
      const std::string_view key = QuotedString();
      Expect(':');
      if (key == "descr") {
        SkipSpace();
        if (!rest_.empty() && rest_.front() != '\'' && rest_.front() != '"') {
          throw Error(where_, "holds records (a structured dtype)",
                      "Save the fields as arrays of their own");
        }
        ParseDescr(QuotedString(), array);
        has_descr = true;
      } else if (key == "fortran_order") {
        array.fortran_order = Boolean();
        has_order = true;
      } else if (key == "shape") {
        array.shape = Tuple();
        has_shape = true;
      } else {
        Fail("an unknown header entry");
      }
      Accept(',');
    }
    if (!has_descr || !has_order || !has_shape) Fail("a header entry is missing");
    return array;
  }

 private:
  [[noreturn]] void Fail(std::string_view problem) const {
    throw Error(where_, fmt::format("has a malformed .npy header ({})", problem),
                "The file is damaged: save it again with numpy.savez");
  }
  void SkipSpace() {
    while (!rest_.empty() && (rest_.front() == ' ' || rest_.front() == '\n')) rest_.remove_prefix(1);
  }
  bool Accept(char c) {
    SkipSpace();
    if (rest_.empty() || rest_.front() != c) return false;
    rest_.remove_prefix(1);
    return true;
  }
  void Expect(char c) {
    if (!Accept(c)) Fail(fmt::format("'{}' expected", c));
  }
  std::string_view QuotedString() {
    SkipSpace();
    if (rest_.empty() || (rest_.front() != '\'' && rest_.front() != '"')) Fail("a quote expected");
    const char quote = rest_.front();
    const auto end = rest_.find(quote, 1);
    if (end == std::string_view::npos) Fail("a text that does not end");
    const std::string_view text = rest_.substr(1, end - 1);
    rest_.remove_prefix(end + 1);
    return text;
  }
  bool Boolean() {
    SkipSpace();
    for (const auto& [word, value] : {std::pair{std::string_view("True"), true}, {"False", false}}) {
      if (rest_.starts_with(word)) {
        rest_.remove_prefix(word.size());
        return value;
      }
    }
    Fail("True or False expected");
  }
  std::vector<std::size_t> Tuple() {
    std::vector<std::size_t> values;
    Expect('(');
    while (!Accept(')')) {
      SkipSpace();
      std::size_t value = 0;
      const auto [end, error] = std::from_chars(rest_.data(), rest_.data() + rest_.size(), value);
      if (error != std::errc()) Fail("a number expected in the shape");
      rest_.remove_prefix(static_cast<std::size_t>(end - rest_.data()));
      Accept('L');  // written by Python 2
      values.push_back(value);
      if (values.size() > 32) Fail("more than 32 dimensions");
      Accept(',');
    }
    return values;
  }
  void ParseDescr(std::string_view descr, NpyArray& array) const {
    if (descr.empty()) Fail("an empty dtype");
    if (std::string_view("<>|=").find(descr.front()) != std::string_view::npos) {
      array.big_endian = descr.front() == '>';
      descr.remove_prefix(1);
    }
    if (descr.empty()) Fail("an empty dtype");
    array.kind = descr.front() == '?' ? 'b' : descr.front();
    std::size_t size = array.kind == 'b' ? 1 : 0;
    if (descr.size() > 1) {
      const auto [end, error] = std::from_chars(descr.data() + 1, descr.data() + descr.size(), size);
      if (error != std::errc() || end != descr.data() + descr.size()) Fail("an unreadable dtype");
    }
    if (array.kind == 'O') {
      throw Error(where_, "holds Python objects (dtype object), which are never loaded",
                  "Save plain numeric arrays");
    }
    const bool known = (array.kind == 'f' && (size == 2 || size == 4 || size == 8)) ||
                       ((array.kind == 'i' || array.kind == 'u') &&
                        (size == 1 || size == 2 || size == 4 || size == 8)) ||
                       (array.kind == 'b' && size == 1) ||
                       ((array.kind == 'U' || array.kind == 'S') && size <= (1 << 20));
    if (!known) {
      throw Error(where_, fmt::format("has dtype '{}', which is not a real number or text", descr),
                  "Save it as float32, float64 or an integer type");
    }
    array.item_size = array.kind == 'U' ? 4 * size : size;
  }

  std::string_view rest_;
  const std::string& where_;
};

std::optional<std::size_t> CheckedProduct(const std::vector<std::size_t>& shape,
                                          std::size_t item_size) {
  std::size_t bytes = item_size;
  for (const std::size_t n : shape) {
    if (n != 0 && bytes > kMaxMemberBytes / n) return std::nullopt;
    bytes *= n;
  }
  return bytes;
}

// --- element access ---

template <typename T>
T LoadAs(const std::byte* bytes, bool big_endian) {
  std::array<std::byte, sizeof(T)> raw;
  std::memcpy(raw.data(), bytes, sizeof(T));
  if (big_endian) std::reverse(raw.begin(), raw.end());
  return std::bit_cast<T>(raw);
}

// Calls `put(c_order_index, byte_pointer)` for each element.
template <typename Put>
void ForEachElement(const NpyArray& array, Put&& put) {
  const std::size_t n = array.NumElements();
  const std::byte* bytes = array.data.data();
  if (!array.fortran_order || array.shape.size() < 2) {
    for (std::size_t i = 0; i < n; ++i) put(i, bytes + i * array.item_size);
    return;
  }
  // Walk the storage in its own (first index fastest) order, keeping the C-order index in step.
  const std::size_t rank = array.shape.size();
  std::vector<std::size_t> stride(rank, 1), index(rank, 0);
  for (std::size_t d = rank - 1; d > 0; --d) stride[d - 1] = stride[d] * array.shape[d];
  std::size_t target = 0;
  for (std::size_t i = 0; i < n; ++i) {
    put(target, bytes + i * array.item_size);
    for (std::size_t d = 0; d < rank; ++d) {
      target += stride[d];
      if (++index[d] < array.shape[d]) break;
      target -= stride[d] * array.shape[d];
      index[d] = 0;
    }
  }
}

template <typename Out>
std::vector<Out> Convert(const NpyMember& member) {
  const NpyArray& array = member.array;
  std::vector<Out> values(array.NumElements());
  const bool be = array.big_endian;
  const auto fill = [&](auto load) {
    ForEachElement(array, [&](std::size_t i, const std::byte* p) {
      values[i] = static_cast<Out>(load(p));
    });
  };
  switch (array.kind) {
    case 'f':
      if (array.item_size == 2) {
        fill([be](const std::byte* p) { return HalfToFloat(LoadAs<std::uint16_t>(p, be)); });
      } else if (array.item_size == 4) {
        fill([be](const std::byte* p) { return LoadAs<float>(p, be); });
      } else {
        fill([be](const std::byte* p) { return LoadAs<double>(p, be); });
      }
      break;
    case 'i':
      switch (array.item_size) {
        case 1: fill([be](const std::byte* p) { return LoadAs<std::int8_t>(p, be); }); break;
        case 2: fill([be](const std::byte* p) { return LoadAs<std::int16_t>(p, be); }); break;
        case 4: fill([be](const std::byte* p) { return LoadAs<std::int32_t>(p, be); }); break;
        default: fill([be](const std::byte* p) { return LoadAs<std::int64_t>(p, be); }); break;
      }
      break;
    case 'u':
    case 'b':
      switch (array.item_size) {
        case 1: fill([be](const std::byte* p) { return LoadAs<std::uint8_t>(p, be); }); break;
        case 2: fill([be](const std::byte* p) { return LoadAs<std::uint16_t>(p, be); }); break;
        case 4: fill([be](const std::byte* p) { return LoadAs<std::uint32_t>(p, be); }); break;
        default: fill([be](const std::byte* p) { return LoadAs<std::uint64_t>(p, be); }); break;
      }
      break;
    default:
      throw Error(member.where, "holds text where numbers are needed", "Check the field");
  }
  return values;
}

struct ZipCloser {
  void operator()(zip_file_t* file) const { zip_fclose(file); }
};

}  // namespace

// --- half precision ---

float HalfToFloat(std::uint16_t half) {
  const std::uint32_t sign = static_cast<std::uint32_t>(half & 0x8000u) << 16;
  const std::uint32_t exponent = (half >> 10) & 0x1fu;
  const std::uint32_t mantissa = half & 0x3ffu;
  if (exponent == 0x1f) return std::bit_cast<float>(sign | 0x7f800000u | (mantissa << 13));
  if (exponent == 0) {
    const float magnitude = static_cast<float>(mantissa) * 0x1p-24f;
    return sign != 0 ? -magnitude : magnitude;
  }
  return std::bit_cast<float>(sign | ((exponent + 112) << 23) | (mantissa << 13));
}

std::uint16_t FloatToHalf(float value) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  const auto sign = static_cast<std::uint16_t>((bits >> 16) & 0x8000u);
  const float magnitude = std::fabs(value);
  if (std::isnan(value)) return static_cast<std::uint16_t>(sign | 0x7e00u);
  if (magnitude >= 65520.0f) return static_cast<std::uint16_t>(sign | 0x7c00u);
  // Scaled so that one unit is the last place of the half: nearbyint then rounds to nearest even.
  const int exponent = std::max(magnitude > 0.0f ? std::ilogb(magnitude) : -14, -14);
  const auto units = static_cast<std::uint32_t>(
      std::lrint(std::ldexp(static_cast<double>(magnitude), 10 - exponent)));
  return static_cast<std::uint16_t>(
      sign + static_cast<std::uint16_t>(units + (static_cast<std::uint32_t>(exponent + 14) << 10)));
}

// --- arrays ---

std::size_t NpyArray::NumElements() const {
  std::size_t n = 1;
  for (const std::size_t d : shape) n *= d;
  return n;
}

std::vector<double> NpyMember::AsDoubles() const { return Convert<double>(*this); }
std::vector<float> NpyMember::AsFloats() const { return Convert<float>(*this); }

std::vector<std::int64_t> NpyMember::AsIntegers() const {
  if (array.kind != 'f') return Convert<std::int64_t>(*this);
  const std::vector<double> doubles = AsDoubles();
  std::vector<std::int64_t> integers(doubles.size());
  for (std::size_t i = 0; i < doubles.size(); ++i) {
    if (!(std::fabs(doubles[i]) < 0x1p53) || doubles[i] != std::floor(doubles[i])) {
      throw Error(where, fmt::format("holds {} where a whole number is needed", doubles[i]),
                  "Check the field");
    }
    integers[i] = static_cast<std::int64_t>(doubles[i]);
  }
  return integers;
}

std::string NpyMember::AsText() const {
  if ((array.kind != 'U' && array.kind != 'S') || array.NumElements() != 1) {
    throw Error(where, fmt::format("is not a single text (shape {})", ShapeText()),
                "Save it as a string");
  }
  std::string text;
  if (array.kind == 'S') {
    for (const std::byte b : array.data) text.push_back(static_cast<char>(b));
  } else {
    for (std::size_t i = 0; i + 4 <= array.data.size(); i += 4) {
      const auto code = LoadAs<std::uint32_t>(array.data.data() + i, array.big_endian);
      if (code < 0x80) {
        text.push_back(static_cast<char>(code));
      } else if (code < 0x800) {
        text.push_back(static_cast<char>(0xc0 | (code >> 6)));
        text.push_back(static_cast<char>(0x80 | (code & 0x3f)));
      } else if (code < 0x10000) {
        text.push_back(static_cast<char>(0xe0 | (code >> 12)));
        text.push_back(static_cast<char>(0x80 | ((code >> 6) & 0x3f)));
        text.push_back(static_cast<char>(0x80 | (code & 0x3f)));
      } else if (code < 0x110000) {
        text.push_back(static_cast<char>(0xf0 | (code >> 18)));
        text.push_back(static_cast<char>(0x80 | ((code >> 12) & 0x3f)));
        text.push_back(static_cast<char>(0x80 | ((code >> 6) & 0x3f)));
        text.push_back(static_cast<char>(0x80 | (code & 0x3f)));
      } else {
        throw Error(where, "holds a character that does not exist", "Save the text again");
      }
    }
  }
  while (!text.empty() && text.back() == '\0') text.pop_back();
  return text;
}

std::string NpyMember::ShapeText() const { return fmt::format("({})", fmt::join(array.shape, ", ")); }

void NpyMember::RequireShape(const std::vector<std::ptrdiff_t>& expected) const {
  bool matches = expected.size() == array.shape.size();
  for (std::size_t d = 0; matches && d < expected.size(); ++d) {
    matches = expected[d] < 0 || static_cast<std::size_t>(expected[d]) == array.shape[d];
  }
  if (matches) return;
  std::vector<std::string> wanted;
  for (const std::ptrdiff_t n : expected) wanted.push_back(n < 0 ? "N" : std::to_string(n));
  throw Error(where, fmt::format("has shape {}", ShapeText()),
              fmt::format("Shape ({}) is needed", fmt::join(wanted, ", ")));
}

// --- reading ---

struct NpzReader::Archive {
  zip_t* zip = nullptr;
};

NpzReader::NpzReader(const fs::path& path) : path_(path) {
  std::error_code error;
  if (!fs::exists(path, error)) throw Error(path.string(), "does not exist", "Check the path");
  if (fs::is_directory(path, error)) {
    throw Error(path.string(), "is a folder, a .npz file is needed", "Name the file inside it");
  }
  if (fs::file_size(path, error) == 0 && !error) {
    throw Error(path.string(), "is empty", "Copy or save it again");
  }
  int code = 0;
  zip_t* zip = zip_open(path.c_str(), ZIP_RDONLY, &code);
  if (zip == nullptr) {
    zip_error_t reason;
    zip_error_init_with_code(&reason, code);
    const std::string text = zip_error_strerror(&reason);
    zip_error_fini(&reason);
    throw Error(path.string(), fmt::format("is not a .npz (zip) archive, or is cut off ({})", text),
                "Give a file written by numpy.savez, or copy it again");
  }
  archive_ = new Archive{zip};
}

NpzReader::NpzReader(std::span<const std::byte> bytes, std::string name) : path_(std::move(name)) {
  zip_error_t reason;
  zip_error_init(&reason);
  zip_source_t* source = zip_source_buffer_create(bytes.data(), bytes.size(), 0, &reason);
  zip_t* zip = source == nullptr ? nullptr : zip_open_from_source(source, ZIP_RDONLY, &reason);
  if (zip == nullptr) {
    if (source != nullptr) zip_source_free(source);
    const std::string text = zip_error_strerror(&reason);
    zip_error_fini(&reason);
    throw Error(path_.string(), fmt::format("is not a .npz (zip) archive ({})", text),
                "Give an archive written by numpy.savez");
  }
  zip_error_fini(&reason);
  archive_ = new Archive{zip};
}

NpzReader::~NpzReader() {
  if (archive_ == nullptr) return;
  zip_discard(archive_->zip);
  delete archive_;
}

NpzReader::NpzReader(NpzReader&& other) noexcept
    : path_(std::move(other.path_)), archive_(std::exchange(other.archive_, nullptr)) {}

NpzReader& NpzReader::operator=(NpzReader&& other) noexcept {
  std::swap(path_, other.path_);
  std::swap(archive_, other.archive_);
  return *this;
}

bool NpzReader::Has(std::string_view key) const {
  return zip_name_locate(archive_->zip, fmt::format("{}.npy", key).c_str(), 0) >= 0;
}

std::vector<std::string> NpzReader::Keys() const {
  std::vector<std::string> keys;
  const auto count = zip_get_num_entries(archive_->zip, 0);
  for (zip_int64_t i = 0; i < count; ++i) {
    const char* name = zip_get_name(archive_->zip, static_cast<zip_uint64_t>(i), 0);
    if (name == nullptr) continue;
    const std::string_view view(name);
    if (view.ends_with(".npy")) keys.emplace_back(view.substr(0, view.size() - 4));
  }
  return keys;
}

NpyMember NpzReader::Read(std::string_view key) const {
  const std::string where = fmt::format("{}[{}]", path_.string(), key);
  const auto index = zip_name_locate(archive_->zip, fmt::format("{}.npy", key).c_str(), 0);
  if (index < 0) {
    throw Error(where, "is missing",
                fmt::format("The file has: {}", fmt::join(Keys(), ", ")));
  }
  const auto damaged = [&](std::string_view detail) {
    return Error(where, fmt::format("is damaged or cut off ({})", detail),
                 "Copy or save the file again");
  };
  zip_stat_t stat;
  if (zip_stat_index(archive_->zip, static_cast<zip_uint64_t>(index), 0, &stat) != 0 ||
      (stat.valid & ZIP_STAT_SIZE) == 0 || (stat.valid & ZIP_STAT_COMP_SIZE) == 0) {
    throw damaged("no size");
  }
  if (stat.size > kMaxMemberBytes || stat.size / kMaxDeflateRatio > stat.comp_size + 1) {
    throw damaged(fmt::format("{} bytes packed claim to be {}", stat.comp_size, stat.size));
  }
  const std::unique_ptr<zip_file_t, ZipCloser> file(
      zip_fopen_index(archive_->zip, static_cast<zip_uint64_t>(index), 0));
  if (!file) throw damaged(zip_strerror(archive_->zip));

  const auto read_exactly = [&](void* target, std::size_t bytes) {
    auto* to = static_cast<char*>(target);
    while (bytes > 0) {
      const auto got = zip_fread(file.get(), to, bytes);
      if (got <= 0) throw damaged(got < 0 ? zip_file_strerror(file.get()) : "ends too early");
      to += got;
      bytes -= static_cast<std::size_t>(got);
    }
  };
  unsigned char preamble[8];
  read_exactly(preamble, sizeof preamble);
  if (std::string_view(reinterpret_cast<char*>(preamble), 6) != kMagic) throw damaged("not .npy data");
  const int length_bytes = preamble[6] == 1 ? 2 : 4;
  unsigned char length_field[4] = {};
  read_exactly(length_field, static_cast<std::size_t>(length_bytes));
  std::size_t header_bytes = 0;
  for (int i = length_bytes - 1; i >= 0; --i) header_bytes = header_bytes << 8 | length_field[i];
  if (header_bytes > kMaxHeaderBytes) throw damaged("an oversized header");
  std::string header(header_bytes, '\0');
  read_exactly(header.data(), header.size());

  NpyMember member{where, HeaderParser(header, where).Parse()};
  const auto bytes = CheckedProduct(member.array.shape, member.array.item_size);
  const std::size_t preceding = sizeof preamble + static_cast<std::size_t>(length_bytes) + header_bytes;
  if (!bytes || *bytes + preceding != stat.size) {
    throw damaged(fmt::format("shape {} does not fit its {} bytes", member.ShapeText(), stat.size));
  }
  member.array.data.resize(*bytes);
  read_exactly(member.array.data.data(), *bytes);
  char beyond;  // reading past the end is what makes libzip compare the checksum
  if (zip_fread(file.get(), &beyond, 1) != 0) throw damaged("checksum");
  return member;
}

// --- writing ---

namespace {

template <typename T>
NpyArray MakeArray(char kind, std::vector<std::size_t> shape, const std::vector<T>& values) {
  NpyArray array{kind, sizeof(T), false, false, std::move(shape), {}};
  if (array.NumElements() != values.size()) {
    throw Error("npz", fmt::format("{} values for shape ({})", values.size(),
                                   fmt::join(array.shape, ", ")), "");
  }
  array.data.resize(values.size() * sizeof(T));
  if (!values.empty()) std::memcpy(array.data.data(), values.data(), array.data.size());
  return array;
}

std::string EncodeNpy(const NpyArray& array) {
  const bool has_order = array.item_size > 1 && array.kind != 'S';
  const std::size_t count = array.kind == 'U' ? array.item_size / 4 : array.item_size;
  std::string shape;
  for (const std::size_t n : array.shape) shape += fmt::format("{}, ", n);
  if (array.shape.size() > 1) shape.resize(shape.size() - 2);
  else if (array.shape.size() == 1) shape.pop_back();  // "(5,)"
  std::string header =
      fmt::format("{{'descr': '{}{}{}', 'fortran_order': {}, 'shape': ({}), }}",
                  has_order ? (array.big_endian ? '>' : '<') : '|', array.kind, count,
                  array.fortran_order ? "True" : "False", shape);
  // Data start on a multiple of 64 bytes, as NumPy writes it, so that files can be mapped.
  const std::size_t unpadded = kMagic.size() + 2 + 2 + header.size() + 1;
  header.append((64 - unpadded % 64) % 64, ' ');
  header.push_back('\n');
  std::string bytes(kMagic);
  bytes.push_back('\x01');
  bytes.push_back('\x00');
  bytes.push_back(static_cast<char>(header.size() & 0xff));
  bytes.push_back(static_cast<char>(header.size() >> 8));
  bytes += header;
  bytes.append(reinterpret_cast<const char*>(array.data.data()), array.data.size());
  return bytes;
}

}  // namespace

void NpzWriter::AddFloat32(std::string key, std::vector<std::size_t> shape,
                           std::vector<float> values) {
  Add(std::move(key), MakeArray('f', std::move(shape), values));
}

void NpzWriter::AddFloat64(std::string key, std::vector<std::size_t> shape,
                           std::vector<double> values) {
  Add(std::move(key), MakeArray('f', std::move(shape), values));
}

void NpzWriter::AddFloat16(std::string key, std::vector<std::size_t> shape,
                           const std::vector<float>& values) {
  std::vector<std::uint16_t> halves(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    halves[i] = FloatToHalf(values[i]);
    if (std::isfinite(values[i]) && !std::isfinite(HalfToFloat(halves[i]))) {
      throw Error(key, fmt::format("{} does not fit half precision", values[i]), "Use float32");
    }
  }
  Add(std::move(key), MakeArray('f', std::move(shape), halves));
}

void NpzWriter::AddInt64(std::string key, std::vector<std::size_t> shape,
                         std::vector<std::int64_t> values) {
  Add(std::move(key), MakeArray('i', std::move(shape), values));
}

void NpzWriter::AddUint32(std::string key, std::vector<std::size_t> shape,
                          std::vector<std::uint32_t> values) {
  Add(std::move(key), MakeArray('u', std::move(shape), values));
}

void NpzWriter::AddUint8(std::string key, std::vector<std::size_t> shape,
                         std::vector<std::uint8_t> values) {
  Add(std::move(key), MakeArray('u', std::move(shape), values));
}

void NpzWriter::AddText(std::string key, std::string_view text) {
  // UTF-8 to UCS-4; ill-formed bytes become U+FFFD rather than a broken file.
  std::vector<std::uint32_t> codes;
  for (std::size_t i = 0; i < text.size();) {
    const auto lead = static_cast<unsigned char>(text[i]);
    const std::size_t length = lead < 0x80 ? 1 : lead >> 5 == 6 ? 2 : lead >> 4 == 14 ? 3
                               : lead >> 3 == 30 ? 4 : 0;
    std::uint32_t code = length == 1 ? lead : length == 2 ? lead & 0x1fu
                         : length == 3 ? lead & 0xfu : lead & 7u;
    bool good = length > 0 && i + length <= text.size();
    for (std::size_t k = 1; good && k < length; ++k) {
      const auto c = static_cast<unsigned char>(text[i + k]);
      good = c >> 6 == 2;
      code = code << 6 | (c & 0x3fu);
    }
    codes.push_back(good ? code : 0xfffdu);
    i += good ? length : 1;
  }
  if (codes.empty()) codes.push_back(0);
  NpyArray array{'U', 4 * codes.size(), false, false, {}, {}};
  array.data.resize(array.item_size);
  std::memcpy(array.data.data(), codes.data(), array.item_size);
  Add(std::move(key), std::move(array));
}

void NpzWriter::Add(std::string key, NpyArray array) {
  arrays_.insert_or_assign(std::move(key), std::move(array));
}

void NpzWriter::Write(const fs::path& path) const {
  WriteAtomically(path, [&](const fs::path& temporary) {
    const auto fail = [&](std::string_view reason) {
      return Error(path.string(), fmt::format("could not be written ({})", reason),
                   "Free some space or choose another folder");
    };
    int code = 0;
    zip_t* zip = zip_open(temporary.c_str(), ZIP_CREATE | ZIP_TRUNCATE, &code);
    if (zip == nullptr) throw fail("cannot be created");
    std::vector<std::string> members;  // libzip reads them when the archive is closed
    members.reserve(arrays_.size());
    for (const auto& [key, array] : arrays_) {
      members.push_back(EncodeNpy(array));
      zip_source_t* source = zip_source_buffer(zip, members.back().data(), members.back().size(), 0);
      const auto index = zip_file_add(zip, (key + ".npy").c_str(), source, ZIP_FL_ENC_UTF_8);
      if (index < 0) {
        zip_source_free(source);
        const std::string reason = zip_strerror(zip);
        zip_discard(zip);
        throw fail(reason);
      }
      const auto id = static_cast<zip_uint64_t>(index);
      zip_set_file_compression(zip, id, ZIP_CM_DEFLATE, 9);
      zip_file_set_dostime(zip, id, 0, (1 << 5) | 1, 0);  // 1980-01-01: same arrays, same bytes
    }
    if (zip_close(zip) != 0) {
      const std::string reason = zip_strerror(zip);
      zip_discard(zip);
      throw fail(reason);
    }
  });
}

}  // namespace holdfast
