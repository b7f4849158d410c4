// SPDX-License-Identifier: MIT
#include "geometry/io/markers/c3d.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <limits>
#include <map>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/json_file.h"

namespace holdfast {
namespace {

constexpr std::size_t kBlock = 512;

// Types of processors, by which the byte order and the form of floats go.
constexpr int kIntel = 84, kDec = 85, kMips = 86;

// A value of the parameter section.
struct Parameter {
  int type = 0;           // bytes of one value; -1: characters
  std::vector<int> size;  // of each dimension, fastest first
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
    return static_cast<std::uint16_t>(processor_ == kMips ? first << 8 | second
                                                          : second << 8 | first);
  }
  std::int16_t Short(std::size_t at) const { return static_cast<std::int16_t>(Word(at)); }
  // DEC's floats have swapped words and an exponent larger by two.
  float Float(std::size_t at) const {
    const std::uint32_t first = Word(at);
    const std::uint32_t second = Word(at + 2);
    if (processor_ == kDec) return std::bit_cast<float>(first << 16 | second) / 4.0F;
    return std::bit_cast<float>(processor_ == kMips ? first << 16 | second : second << 16 | first);
  }

  void ReadParameters() {
    const std::size_t start = (std::size_t{Byte(0)} - 1) * kBlock;
    processor_ = Byte(start + 3);
    if (processor_ < kIntel || processor_ > kMips) {
      Fail(fmt::format("has an unknown processor type ({})", processor_));
    }
    // End of the section by its own count of blocks, and by the data block in the header: one of
    // them may be wrong.
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

  // Whole number from 0 to below 2^31; floats may hold larger ones, and anything.
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
      Note(fmt::format("POINT:DATA_START is not a data block; read from block {}, {}", data_block,
                       Word(16) >= 2 ? "as the header states" : "after the parameters"));
    }
    recording_.first_frame = static_cast<int>(LongOf("TRIAL:ACTUAL_START_FIELD", Word(6)));
    const long last = LongOf("TRIAL:ACTUAL_END_FIELD", Word(8));
    frames_ = last - recording_.first_frame + 1;
    // Writers of long captures put 65,535 in the header and the number of frames in a float.
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
    recording_.meters_per_unit = unit->meters;
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
      Fail(
          fmt::format("is cut off: the header states {} frames of {} bytes, but there are {} bytes",
                      frames_, frame_bytes, bytes_.size() - std::min(data_, bytes_.size())));
    }
    const double factor = recording_.meters_per_unit * (floats ? 1.0 : scale_);
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
  int processor_ = kIntel;
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

namespace {

constexpr std::size_t kLongestLabel = 127;  // 255 of them are within a 16-bit offset
constexpr int kLabelsOfOneParameter = 255, kMaxWord = 65535;

void PutWord(std::string& bytes, unsigned value) {
  bytes += static_cast<char>(value & 255);
  bytes += static_cast<char>(value >> 8 & 255);
}

void PutFloat(std::string& bytes, float value) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  PutWord(bytes, bits & kMaxWord);
  PutWord(bytes, bits >> 16);
}

std::string Words(std::initializer_list<unsigned> values) {
  std::string bytes;
  for (const unsigned value : values) PutWord(bytes, value);
  return bytes;
}

std::string FloatBytes(double value) {
  std::string bytes;
  PutFloat(bytes, static_cast<float>(value));
  return bytes;
}

// Parameter section: groups by number, each followed by its parameters.
class C3dParameters {
 public:
  void Group(std::string_view name) {
    ++group_;
    Begin(name, -group_);
    PutWord(bytes_, 3);  // offset to the next entry
    bytes_ += '\0';      // no description
  }
  // type: bytes per value, -1 for characters; size: fastest dimension first.
  void Add(std::string_view name, int type, std::initializer_list<std::size_t> size,
           std::string_view data) {
    Begin(name, group_);
    PutWord(bytes_, static_cast<unsigned>(2 + 2 + size.size() + data.size() + 1));
    bytes_ += static_cast<char>(type);
    bytes_ += static_cast<char>(size.size());
    for (const std::size_t n : size) bytes_ += static_cast<char>(n);
    bytes_ += data;
    bytes_ += '\0';
  }
  void Add(std::string_view name, unsigned word) { Add(name, 2, {}, Words({word})); }
  // Blocks, including the four bytes before the first group and the two that end the last.
  std::size_t Blocks() const { return (4 + bytes_.size() + 2 + kBlock - 1) / kBlock; }
  const std::string& Bytes() const { return bytes_; }

 private:
  void Begin(std::string_view name, int id) {
    bytes_ += static_cast<char>(name.size());
    bytes_ += static_cast<char>(id);
    bytes_ += name;
  }

  std::string bytes_;
  int group_ = 0;
};

std::vector<std::string> LabelsOf(const MarkerRecording& recording, const std::string& where) {
  std::vector<std::string> labels;
  for (std::size_t m = 0; m < recording.names.size(); ++m) {
    const std::string subject = m < recording.subjects.size() ? recording.subjects[m] : "";
    labels.push_back(subject.empty() ? recording.names[m] : subject + ':' + recording.names[m]);
    if (labels.back().empty() || labels.back().size() > kLongestLabel) {
      throw Error(where,
                  fmt::format("the label of marker {} has {} bytes", m, labels.back().size()),
                  fmt::format("Give 1 to {}", kLongestLabel));
    }
  }
  return labels;
}

void AddLabels(const std::vector<std::string>& labels, C3dParameters& parameters) {
  std::size_t width = 0;
  for (const std::string& label : labels) width = std::max(width, label.size());
  for (std::size_t begin = 0; begin < labels.size(); begin += kLabelsOfOneParameter) {
    const std::size_t count = std::min<std::size_t>(kLabelsOfOneParameter, labels.size() - begin);
    std::string text;
    for (std::size_t m = begin; m < begin + count; ++m) {
      text += labels[m] + std::string(width - labels[m].size(), ' ');
    }
    const std::size_t part = begin / kLabelsOfOneParameter + 1;
    parameters.Add(part == 1 ? "LABELS" : fmt::format("LABELS{}", part), -1, {width, count}, text);
  }
}

C3dParameters ParametersOf(const MarkerRecording& recording, unsigned data_block,
                           const std::string& where) {
  const auto frames = static_cast<unsigned>(recording.NumFrames());
  const auto first = static_cast<unsigned>(recording.first_frame), last = first + frames - 1;
  C3dParameters parameters;
  parameters.Group("POINT");
  parameters.Add("USED", static_cast<unsigned>(recording.NumMarkers()));
  parameters.Add("SCALE", 4, {}, FloatBytes(-1.0));
  parameters.Add("RATE", 4, {}, FloatBytes(recording.rate_hz));
  parameters.Add("DATA_START", data_block);
  parameters.Add("FRAMES", std::min<unsigned>(frames, kMaxWord));
  parameters.Add("UNITS", -1, {2}, "mm");
  AddLabels(LabelsOf(recording, where), parameters);
  parameters.Group("ANALOG");
  parameters.Add("USED", 0);
  parameters.Group("TRIAL");
  parameters.Add("ACTUAL_START_FIELD", 2, {2}, Words({first & kMaxWord, first >> 16}));
  parameters.Add("ACTUAL_END_FIELD", 2, {2}, Words({last & kMaxWord, last >> 16}));
  return parameters;
}

std::string HeaderOf(const MarkerRecording& recording, unsigned data_block) {
  const auto clamped = [](unsigned number) { return std::min<unsigned>(number, kMaxWord); };
  const auto first = static_cast<unsigned>(recording.first_frame);
  std::string header = "\x02\x50";
  PutWord(header, static_cast<unsigned>(recording.NumMarkers()));
  PutWord(header, 0);  // analog values per frame
  PutWord(header, clamped(first));
  PutWord(header, clamped(first + static_cast<unsigned>(recording.NumFrames()) - 1));
  PutWord(header, 0);  // interpolated gaps
  PutFloat(header, -1.0F);
  PutWord(header, data_block);
  PutWord(header, 0);
  PutFloat(header, static_cast<float>(recording.rate_hz));
  header.resize(kBlock, '\0');
  return header;
}

}  // namespace

std::string C3dBytes(const MarkerRecording& recording, const std::string& where) {
  const int markers = recording.NumMarkers(), frames = recording.NumFrames();
  if (markers < 1 || markers > kMaxWord || frames < 1) {
    throw Error(where, fmt::format("{} markers and {} frames are not a valid C3D", markers, frames),
                fmt::format("Give 1 to {} markers, a frame or more", kMaxWord));
  }
  const std::size_t blocks = ParametersOf(recording, 0, where).Blocks();
  if (blocks > 255) {
    throw Error(where, fmt::format("the labels of {} markers do not fit into a C3D", markers),
                "Give fewer, or shorter ones");
  }
  const auto data_block = static_cast<unsigned>(2 + blocks);
  std::string bytes = HeaderOf(recording, data_block);
  bytes += {1, 0x50, static_cast<char>(blocks), kIntel};
  bytes += ParametersOf(recording, data_block, where).Bytes();
  bytes.resize((1 + blocks) * kBlock, '\0');
  for (int t = 0; t < frames; ++t) {
    for (int m = 0; m < markers; ++m) {
      const bool seen = recording.Seen(m, t);
      for (int c = 0; c < 3; ++c) {
        PutFloat(bytes, seen ? static_cast<float>(1e3 * recording.At(m, t)[c]) : 0.0F);
      }
      PutFloat(bytes, seen ? 0.0F : -1.0F);
    }
  }
  return bytes;
}

void WriteC3d(const MarkerRecording& recording, const std::filesystem::path& path) {
  WriteAtomically(path, C3dBytes(recording, path.string()));
}

}  // namespace holdfast
