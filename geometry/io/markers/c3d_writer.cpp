// SPDX-License-Identifier: MIT
#include "geometry/io/markers/c3d_writer.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"

namespace holdfast {
namespace {

constexpr std::size_t kC3dBlock = 512;
constexpr std::size_t kLongestLabel = 127;  // 255 of them are reached by an offset of 16 bits
constexpr int kLabelsOfOneParameter = 255, kMostWord = 65535;

void PutWord(std::string& bytes, unsigned value) {
  bytes += static_cast<char>(value & 255);
  bytes += static_cast<char>(value >> 8 & 255);
}

void PutFloat(std::string& bytes, float value) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  PutWord(bytes, bits & kMostWord);
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

// The section of parameters: groups by number, each followed by what is in it.
class C3dParameters {
 public:
  void Group(std::string_view name) {
    ++group_;
    Begin(name, -group_);
    PutWord(bytes_, 3);  // to the next, from here
    bytes_ += '\0';      // no description
  }
  // type: bytes of a value, -1 for characters; the fastest dimension first.
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
  // Blocks, with the four bytes before the first group and the two that end the last.
  std::size_t Blocks() const { return (4 + bytes_.size() + 2 + kC3dBlock - 1) / kC3dBlock; }
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
  parameters.Add("FRAMES", std::min<unsigned>(frames, kMostWord));
  parameters.Add("UNITS", -1, {2}, "mm");
  AddLabels(LabelsOf(recording, where), parameters);
  parameters.Group("ANALOG");
  parameters.Add("USED", 0);
  parameters.Group("TRIAL");
  parameters.Add("ACTUAL_START_FIELD", 2, {2}, Words({first & kMostWord, first >> 16}));
  parameters.Add("ACTUAL_END_FIELD", 2, {2}, Words({last & kMostWord, last >> 16}));
  return parameters;
}

std::string HeaderOf(const MarkerRecording& recording, unsigned data_block) {
  const auto clamped = [](unsigned number) { return std::min<unsigned>(number, kMostWord); };
  const auto first = static_cast<unsigned>(recording.first_frame);
  std::string header = "\x02\x50";
  PutWord(header, static_cast<unsigned>(recording.NumMarkers()));
  PutWord(header, 0);  // analog values a frame
  PutWord(header, clamped(first));
  PutWord(header, clamped(first + static_cast<unsigned>(recording.NumFrames()) - 1));
  PutWord(header, 0);  // gaps that were interpolated
  PutFloat(header, -1.0F);
  PutWord(header, data_block);
  PutWord(header, 0);
  PutFloat(header, static_cast<float>(recording.rate_hz));
  header.resize(kC3dBlock, '\0');
  return header;
}

}  // namespace

std::string C3dBytes(const MarkerRecording& recording, const std::string& where) {
  const int markers = recording.NumMarkers(), frames = recording.NumFrames();
  if (markers < 1 || markers > kMostWord || frames < 1) {
    throw Error(where, fmt::format("{} markers and {} frames are no C3D", markers, frames),
                fmt::format("Give 1 to {} markers, a frame or more", kMostWord));
  }
  const std::size_t blocks = ParametersOf(recording, 0, where).Blocks();
  if (blocks > 255) {
    throw Error(where, fmt::format("the labels of {} markers are more than a C3D holds", markers),
                "Give fewer, or shorter ones");
  }
  const auto data_block = static_cast<unsigned>(2 + blocks);
  std::string bytes = HeaderOf(recording, data_block);
  bytes += {1, 0x50, static_cast<char>(blocks), 84};
  bytes += ParametersOf(recording, data_block, where).Bytes();
  bytes.resize((1 + blocks) * kC3dBlock, '\0');
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
