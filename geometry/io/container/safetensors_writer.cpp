// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/half.h"
#include "geometry/io/container/safetensors.h"

namespace holdfast {
namespace {

template <typename T>
std::vector<std::byte> BytesOf(std::span<const T> values) {
  const auto bytes = std::as_bytes(values);
  return {bytes.begin(), bytes.end()};
}

// The upper half of the float, to nearest even; a NaN stays one.
std::uint16_t FloatToBfloat(float value) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  if (std::isnan(value)) return static_cast<std::uint16_t>(bits >> 16 | 0x40u);
  return static_cast<std::uint16_t>((bits + 0x7fffu + (bits >> 16 & 1u)) >> 16);
}

template <typename Narrow>
std::vector<std::uint16_t> Narrowed(const std::string& name, std::span<const float> values,
                                    std::uint16_t infinity, Narrow narrow) {
  std::vector<std::uint16_t> halves(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    halves[i] = narrow(values[i]);
    if (std::isfinite(values[i]) && (halves[i] & 0x7fffu) == infinity) {
      throw Error(name, fmt::format("{} does not fit 16 bits", values[i]), "Use float32");
    }
  }
  return halves;
}

}  // namespace

void SafetensorsWriter::Insert(std::string name, Tensor tensor) {
  std::size_t bytes = tensor.item_size;
  for (const std::size_t n : tensor.shape) bytes *= n;
  if (bytes != tensor.data.size()) {
    throw Error(name,
                fmt::format("has {} values for shape ({})", tensor.data.size() / tensor.item_size,
                            fmt::join(tensor.shape, ", ")),
                "Give as many as the shape asks for");
  }
  if (name.empty() || name == "__metadata__") {
    throw Error(fmt::format("'{}'", name), "is not a valid tensor name", "Choose another name");
  }
  tensors_.insert_or_assign(std::move(name), std::move(tensor));
}

void SafetensorsWriter::AddFloat32(std::string name, std::vector<std::size_t> shape,
                                   std::span<const float> values) {
  Insert(std::move(name), {"F32", std::move(shape), BytesOf(values), 4});
}

void SafetensorsWriter::AddFloat64(std::string name, std::vector<std::size_t> shape,
                                   std::span<const double> values) {
  Insert(std::move(name), {"F64", std::move(shape), BytesOf(values), 8});
}

void SafetensorsWriter::AddFloat16(std::string name, std::vector<std::size_t> shape,
                                   std::span<const float> values) {
  const auto halves = Narrowed(name, values, 0x7c00, FloatToHalf);
  Insert(std::move(name),
         {"F16", std::move(shape), BytesOf(std::span<const std::uint16_t>(halves)), 2});
}

void SafetensorsWriter::AddBfloat16(std::string name, std::vector<std::size_t> shape,
                                    std::span<const float> values) {
  const auto halves = Narrowed(name, values, 0x7f80, FloatToBfloat);
  Insert(std::move(name),
         {"BF16", std::move(shape), BytesOf(std::span<const std::uint16_t>(halves)), 2});
}

void SafetensorsWriter::AddInt64(std::string name, std::vector<std::size_t> shape,
                                 std::span<const std::int64_t> values) {
  Insert(std::move(name), {"I64", std::move(shape), BytesOf(values), 8});
}

void SafetensorsWriter::Add(std::string name, NpyArray array) {
  const bool numbers = std::string_view("fiub").find(array.kind) != std::string_view::npos;
  if (!numbers || (array.big_endian && array.item_size > 1) ||
      (array.fortran_order && array.shape.size() > 1)) {
    throw Error(name, "is not an array of numbers in C order and little-endian",
                "Convert it first");
  }
  const char letter = array.kind == 'f' ? 'F' : array.kind == 'i' ? 'I' : 'U';
  Insert(std::move(name),
         {array.kind == 'b' ? "BOOL" : fmt::format("{}{}", letter, 8 * array.item_size),
          std::move(array.shape), std::move(array.data), array.item_size});
}

void SafetensorsWriter::Write(const std::filesystem::path& path) const {
  std::vector<const std::pair<const std::string, Tensor>*> order;
  for (const auto& tensor : tensors_) order.push_back(&tensor);
  std::stable_sort(order.begin(), order.end(), [](const auto* a, const auto* b) {
    return a->second.item_size > b->second.item_size;
  });
  nlohmann::ordered_json header = nlohmann::ordered_json::object();
  if (!metadata_.empty()) header["__metadata__"] = metadata_;
  std::size_t reached = 0;
  for (const auto* tensor : order) {
    const auto& [name, content] = *tensor;
    const std::size_t end = reached + content.data.size();
    header[name] = {
        {"dtype", content.dtype}, {"shape", content.shape}, {"data_offsets", {reached, end}}};
    reached = end;
  }
  std::string text;
  try {
    text = header.dump();
  } catch (const nlohmann::json::exception&) {
    throw Error(path.string(), "has a name or metadata that are not UTF-8", "Use other names");
  }
  text.append((8 - text.size() % 8) % 8, ' ');  // the tensors begin aligned
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
