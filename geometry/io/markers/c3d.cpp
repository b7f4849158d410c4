// SPDX-License-Identifier: MIT
#include "geometry/io/markers/c3d.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <map>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/container/json_text.h"

namespace holdfast {
namespace {

constexpr std::size_t kBlock = 512;

enum class Processor { kIntel = 84, kDec = 85, kMips = 86 };

// A value of the parameter section.
struct Parameter {
  int type = 0;           // bytes of one value; -1: characters
  std::vector<int> size;  // of each dimension, the fastest first
  std::size_t begin = 0, bytes = 0;

  std::size_t Count() const { return bytes / static_cast<std::size_t>(std::abs(type)); }
};

class C3dParser {
 public:
  C3dParser(std::string_view bytes, const std::string& where) : bytes_(bytes), where_(where) {}

  MarkerRecording Parse() {
    ReadParameters();
    ReadHeader();
    SetMarkerNames(Labels(), where_, recording_);
    ReadPoints();
    return std::move(recording_);
  }

 private:
  [[noreturn]] void Fail(const std::string& problem) const {
    throw Error(where_, problem, "Export it again from the capture software");
  }
  void Note(const std::string& note) { recording_.notes.push_back(where_ + ": " + note); }

  std::uint8_t Byte(std::size_t at) const {
    if (at >= bytes_.size()) Fail(fmt::format("is cut off: {} bytes", bytes_.size()));
    return static_cast<std::uint8_t>(bytes_[at]);
  }
  std::uint16_t Word(std::size_t at) const {
    const unsigned first = Byte(at);
    const unsigned second = Byte(at + 1);
    return static_cast<std::uint16_t>(processor_ == Processor::kMips ? first << 8 | second
                                                                     : second << 8 | first);
  }
  std::int16_t Short(std::size_t at) const { return static_cast<std::int16_t>(Word(at)); }
  // DEC's floats have their words swapped and an exponent larger by two.
  float Float(std::size_t at) const {
    const std::uint32_t first = Word(at);
    const std::uint32_t second = Word(at + 2);
    if (processor_ == Processor::kDec) return std::bit_cast<float>(first << 16 | second) / 4.0F;
    return std::bit_cast<float>(processor_ == Processor::kMips ? first << 16 | second
                                                               : second << 16 | first);
  }

  void ReadParameters() {
    const std::size_t start = (std::size_t{Byte(0)} - 1) * kBlock;
    const int processor = Byte(start + 3);
    if (processor < 84 || processor > 86) Fail(fmt::format("names no processor ({})", processor));
    processor_ = static_cast<Processor>(processor);
    // The section's end as its own count of blocks and as the header's block of data have it: one
    // of them may be wrong.
    after_parameters_ = start + kBlock * std::max<std::size_t>(1, Byte(start + 2));
    const std::size_t data_block = Word(16);
    const std::size_t header_data =
        data_block > Byte(0) ? (data_block - 1) * kBlock : after_parameters_;
    const auto [nearer, farther] = std::minmax(after_parameters_, header_data);
    std::map<int, std::string> groups;
    std::vector<std::tuple<int, std::string, Parameter>> found;
    std::size_t at = start + 4;
    const auto end_here = [&] {
      Note("the last parameter's link points beyond the section of parameters");
    };
    while (true) {
      if (at >= farther) {
        end_here();
        break;
      }
      try {
        const int length = std::abs(static_cast<std::int8_t>(Byte(at)));
        if (length == 0) break;
        const int id = static_cast<std::int8_t>(Byte(at + 1));
        Byte(at + 2 + length);
        std::string name(bytes_.substr(at + 2, length));
        std::ranges::transform(name, name.begin(),
                               [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
        const std::size_t link = at + 2 + length;
        const std::size_t step = Word(link);
        if (id < 0) {
          groups[-id] = name;
        } else {
          found.emplace_back(id, name, ReadValue(link + 2));
        }
        if (step == 0) break;
        at = link + step;
      } catch (const Error&) {
        if (at < nearer) throw;
        end_here();
        break;
      }
    }
    for (auto& [id, name, value] : found) {
      const auto group = groups.find(id);
      if (group != groups.end()) parameters_[group->second + ":" + name] = std::move(value);
    }
  }

  Parameter ReadValue(std::size_t at) const {
    Parameter value;
    value.type = static_cast<std::int8_t>(Byte(at));
    if (value.type != -1 && value.type != 1 && value.type != 2 && value.type != 4) {
      Fail(fmt::format("has a parameter of type {}", value.type));
    }
    const int dimensions = Byte(at + 1);
    value.bytes = static_cast<std::size_t>(std::abs(value.type));
    for (int d = 0; d < dimensions; ++d) {
      value.size.push_back(Byte(at + 2 + d));
      value.bytes *= static_cast<std::size_t>(value.size.back());
      if (value.bytes > bytes_.size()) Fail("has a parameter that is longer than the file");
    }
    value.begin = at + 2 + dimensions;
    if (value.bytes > 0) Byte(value.begin + value.bytes - 1);
    return value;
  }

  const Parameter* Find(const std::string& name) const {
    const auto found = parameters_.find(name);
    return found == parameters_.end() || found->second.bytes == 0 ? nullptr : &found->second;
  }

  // A whole number between 0 and 2^31; floats have large ones, and anything.
  long Whole(double value, const char* name) const {
    if (!(value >= 0.0) || !(value < 2147483648.0)) Fail(fmt::format("has {} {}", name, value));
    return static_cast<long>(value);
  }

  double Number(const std::string& name, double otherwise) const {
    const Parameter* value = Find(name);
    if (value == nullptr || value->type == -1) return otherwise;
    if (value->type == 4) return Float(value->begin);
    return value->type == 2 ? Word(value->begin) : Byte(value->begin);
  }

  std::vector<std::string> Texts(const std::string& name) const {
    const Parameter* value = Find(name);
    std::vector<std::string> texts;
    if (value == nullptr || value->type != -1 || value->size.empty()) return texts;
    const auto width = static_cast<std::size_t>(value->size.front());
    for (std::size_t at = 0; at + width <= value->bytes; at += width) {
      std::string_view text = bytes_.substr(value->begin + at, width);
      text = text.substr(0, text.find_last_not_of(std::string_view(" \0", 2)) + 1);
      texts.emplace_back(text);
    }
    return texts;
  }

  void ReadHeader() {
    points_ = static_cast<int>(Whole(Number("POINT:USED", Word(2)), "POINT:USED"));
    analog_ = Word(4);
    scale_ = Number("POINT:SCALE", Float(12));
    const double header_rate = Float(20);
    recording_.rate_hz = Number("POINT:RATE", header_rate);
    long data_block = Whole(Number("POINT:DATA_START", Word(16)), "POINT:DATA_START");
    if (data_block < 2) {
      data_block = Word(16) >= 2 ? Word(16) : static_cast<long>(after_parameters_ / kBlock) + 1;
      Note(fmt::format("POINT:DATA_START names no block of data; read from block {}, {}",
                       data_block,
                       Word(16) >= 2 ? "as the header has it" : "behind the parameters"));
    }
    recording_.first_frame = static_cast<int>(LongOf("TRIAL:ACTUAL_START_FIELD", Word(6)));
    const long last = LongOf("TRIAL:ACTUAL_END_FIELD", Word(8));
    frames_ = last - recording_.first_frame + 1;
    // Writers of long captures leave 65,535 in the header and the number in a float.
    const double told = Number("POINT:FRAMES", 0.0);
    if (told > static_cast<double>(frames_) && !Find("TRIAL:ACTUAL_END_FIELD")) {
      frames_ = Whole(told, "POINT:FRAMES");
    }
    if (points_ < 1 || points_ > 65535) Fail(fmt::format("has {} points", points_));
    if (!(recording_.rate_hz > 0.0) || !(recording_.rate_hz < 1e5)) {
      Fail(fmt::format("has a rate of {} Hz", recording_.rate_hz));
    }
    if (!std::isfinite(scale_) || scale_ == 0.0) Fail("has no scale (POINT:SCALE)");
    data_ = (static_cast<std::size_t>(data_block) - 1) * kBlock;
    const std::vector<std::string> units = Texts("POINT:UNITS");
    recording_.unit = units.empty() || units.front().empty() ? "mm" : units.front();
    recording_.unit = AsUtf8(recording_.unit);
    const std::optional<LengthUnit> unit = FindLengthUnit(recording_.unit);
    if (!unit) Fail(fmt::format("has an unknown unit '{}' (POINT:UNITS)", recording_.unit));
    if (unit->cut_off) {
      Note(fmt::format("the unit '{}' is cut off; read as {}", recording_.unit, unit->name));
    }
    recording_.metres_per_unit = unit->metres;
  }

  // Two words, the low one first.
  long LongOf(const std::string& name, long otherwise) const {
    const Parameter* value = Find(name);
    if (value == nullptr) return otherwise;
    if (value->type == 4) return Whole(Float(value->begin), name.c_str());
    if (value->type != 2 || value->bytes < 4) return otherwise;
    return Whole(Word(value->begin) + 65536.0 * Word(value->begin + 2), name.c_str());
  }

  std::vector<std::string> Labels() const {
    std::vector<std::string> labels = Texts("POINT:LABELS");
    for (int k = 2; Find(fmt::format("POINT:LABELS{}", k)) != nullptr; ++k) {
      for (std::string& label : Texts(fmt::format("POINT:LABELS{}", k))) {
        labels.push_back(std::move(label));
      }
    }
    labels.resize(static_cast<std::size_t>(points_));
    for (int p = 0; p < points_; ++p) {
      if (labels[p].empty()) labels[p] = fmt::format("point {}", p + 1);
    }
    return labels;
  }

  void ReadPoints() {
    const bool floats = scale_ < 0.0;
    const std::size_t number = floats ? 4 : 2;
    const std::size_t frame_bytes =
        number * (4 * static_cast<std::size_t>(points_) + static_cast<std::size_t>(analog_));
    if (frames_ < 1) Fail("has no frames");
    if (data_ > bytes_.size() ||
        static_cast<std::size_t>(frames_) > (bytes_.size() - data_) / frame_bytes) {
      Fail(fmt::format("is cut off: {} frames of {} bytes are told, {} bytes are there", frames_,
                       frame_bytes, bytes_.size() - std::min(data_, bytes_.size())));
    }
    const double factor = recording_.metres_per_unit * (floats ? 1.0 : scale_);
    recording_.positions.resize(3 * points_, frames_);
    for (long t = 0; t < frames_; ++t) {
      for (int p = 0; p < points_; ++p) {
        const std::size_t at = data_ + static_cast<std::size_t>(t) * frame_bytes +
                               4 * number * static_cast<std::size_t>(p);
        Eigen::Vector3d point;
        for (int c = 0; c < 3; ++c) {
          point[c] = factor * (floats ? Float(at + number * c) : Short(at + number * c));
        }
        const double residual = floats ? Float(at + 12) : Short(at + 6);
        const bool seen = residual >= 0.0 && point.allFinite() && !point.isZero(0.0);
        if (!seen) point.setConstant(std::numeric_limits<double>::quiet_NaN());
        recording_.positions.block<3, 1>(3 * p, t) = point;
      }
    }
  }

  std::string_view bytes_;
  const std::string& where_;
  Processor processor_ = Processor::kIntel;
  std::map<std::string, Parameter> parameters_;
  MarkerRecording recording_;
  int points_ = 0, analog_ = 0;
  long frames_ = 0;
  double scale_ = 0.0;
  std::size_t data_ = 0, after_parameters_ = 0;
};

}  // namespace

bool LooksLikeC3d(std::string_view head) {
  return head.size() >= kBlock && head[0] >= 2 && head[0] < 20 && head[1] == 0x50;
}

MarkerRecording ParseC3d(std::string_view bytes, const std::string& where) {
  return C3dParser(bytes, where).Parse();
}

}  // namespace holdfast
