// SPDX-License-Identifier: MIT
#include "geometry/io/motion/bvh.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/body/body_kinematics.h"
#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/byte_source.h"
#include "geometry/io/container/text_scanner.h"
#include "geometry/io/motion/motion_file.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

constexpr int kMaxJoints = 1000;

struct Channel {
  int joint;
  int axis;  // 0 x, 1 y, 2 z
  bool rotates;
};

Eigen::Vector3d ReadOffset(TextScanner& scanner, double scale) {
  scanner.Expect("OFFSET", "each joint starts with its offset");
  Eigen::Vector3d offset;
  for (double& x : offset) x = scale * scanner.Number("a number of OFFSET");
  return offset;
}

void ReadChannels(TextScanner& scanner, int joint, std::vector<Channel>& channels) {
  const int count = scanner.Integer("the number of channels", 0, 6);
  unsigned seen = 0;
  for (int i = 0; i < count; ++i) {
    const std::string_view word = scanner.Next();
    const std::size_t axis = word.empty() ? word.npos : std::string_view("XYZxyz").find(word[0]);
    const bool rotates = !word.empty() && EqualIgnoringCase(word.substr(1), "rotation");
    const bool moves = !word.empty() && EqualIgnoringCase(word.substr(1), "position");
    if (axis == word.npos || (!rotates && !moves)) {
      scanner.Fail(
          fmt::format("channel {} of {} is not one of X/Y/Zposition, X/Y/Zrotation", i + 1, count),
          "Repair the line");
    }
    const Channel channel{joint, static_cast<int>(axis % 3), rotates};
    const unsigned bit = 1u << (channel.axis + (rotates ? 3 : 0));
    if (seen & bit) scanner.Fail(fmt::format("channel {} repeats", i + 1), "Repair the line");
    seen |= bit;
    channels.push_back(channel);
  }
}

// Iterative, so that deep nesting takes a vector, not the stack. Returns the channels of all joints
// in file order.
std::vector<Channel> ReadHierarchy(TextScanner& scanner, double scale, SourceMotion& motion) {
  scanner.Expect("HIERARCHY", "first word of a BVH file");
  std::vector<Channel> channels;
  std::vector<int> open;  // joints whose '{' is not yet closed
  std::vector<Eigen::Vector3d> offsets;
  const std::string_view first = scanner.Peek();
  if (!EqualIgnoringCase(first, "ROOT")) scanner.Expect("ROOT", "the skeleton starts with it");
  while (true) {
    const std::string_view word = scanner.Next();
    const bool root = open.empty() && EqualIgnoringCase(word, "ROOT");
    if (root || (!open.empty() && EqualIgnoringCase(word, "JOINT"))) {
      if (motion.NumJoints() == kMaxJoints) {
        scanner.Fail(fmt::format("more than {} joints", kMaxJoints), "Give a body's skeleton");
      }
      std::string name(scanner.RestOfLine());
      const bool brace_on_line = name.ends_with('{');
      if (brace_on_line) {
        name.pop_back();
        while (name.ends_with(' ') || name.ends_with('\t')) name.pop_back();
      }
      if (name.empty()) scanner.Fail("a joint without a name", "Name the joint");
      if (!brace_on_line) scanner.Expect("{", "after a joint's name");
      const int joint = motion.NumJoints();
      motion.joint_names.push_back(std::move(name));
      motion.parents.push_back(open.empty() ? -1 : open.back());
      open.push_back(joint);
      offsets.push_back(ReadOffset(scanner, scale));
      if (EqualIgnoringCase(scanner.Peek(), "CHANNELS")) {
        scanner.Next();
        ReadChannels(scanner, joint, channels);
      }
    } else if (!open.empty() && EqualIgnoringCase(word, "End")) {
      scanner.RestOfLine();  // "Site", or a name some exporters write here
      scanner.Expect("{", "after End Site");
      motion.end_sites.push_back({open.back(), ReadOffset(scanner, scale)});
      scanner.Expect("}", "after the offset of an End Site");
    } else if (!open.empty() && word == "}") {
      open.pop_back();
      // Some files hold a second skeleton, or an object, as another root.
      if (open.empty() && !EqualIgnoringCase(scanner.Peek(), "ROOT")) break;
    } else {
      scanner.Fail(word.empty() ? "ends inside the hierarchy"
                                : "expected JOINT, End Site or '}' in the hierarchy",
                   "Balance the braces, or export the motion again");
    }
  }
  motion.rest_offsets.resize(3, motion.NumJoints());
  for (int j = 0; j < motion.NumJoints(); ++j) motion.rest_offsets.col(j) = offsets[j];
  return channels;
}

void ReadFrame(TextScanner& scanner, int frame, int num_frames, double scale,
               const std::vector<Channel>& channels, SourceMotion& motion) {
  const int num_joints = motion.NumJoints();
  std::vector<Eigen::Quaterniond> local(num_joints, Eigen::Quaterniond::Identity());
  Eigen::Matrix3Xd offset = motion.rest_offsets;
  for (std::size_t i = 0; i < channels.size(); ++i) {
    const Channel& channel = channels[i];
    if (scanner.AtEnd()) {
      scanner.Fail(fmt::format("ends in frame {} of {} after {} of {} numbers", frame + 1,
                               num_frames, i, channels.size()),
                   "Lower 'Frames:' to the frames that are there, or fetch the file again");
    }
    const double value = scanner.Number(fmt::format("a value of frame {}", frame + 1));
    if (channel.rotates) {
      // Angles are taken modulo a turn, which keeps sine and cosine exact for huge values.
      const double angle = std::remainder(value, 360.0) * kDegree;
      local[channel.joint] =
          local[channel.joint] * Eigen::AngleAxisd(angle, Eigen::Vector3d::Unit(channel.axis));
    } else {
      offset(channel.axis, channel.joint) = scale * value;
    }
  }
  Eigen::Matrix3Xd position(3, num_joints);
  const std::size_t begin = motion.rotations.size();
  for (int j = 0; j < num_joints; ++j) {
    const int parent = motion.parents[j];
    if (parent < 0) {
      motion.rotations.push_back(local[j]);
      position.col(j) = offset.col(j);
    } else {
      const Eigen::Quaterniond& above = motion.rotations[begin + parent];
      position.col(j) = position.col(parent) + above * offset.col(j);
      motion.rotations.push_back((above * local[j]).normalized());
    }
  }
  if (!position.allFinite()) {
    scanner.Fail(fmt::format("positions of frame {} overflow", frame + 1),
                 "Repair the offsets and positions");
  }
  motion.positions.push_back(std::move(position));
}

bool IsNumberWith(char point, std::string_view word) {
  const std::size_t at = word.find(point);
  if (at == word.npos) return false;
  std::string plain(word);
  plain[at] = '.';
  double value = 0;
  return ParseNumber(plain, value);
}

// Returns the text with decimal points if its numbers have decimal commas and none has a point.
std::optional<std::string> WithDecimalPoints(std::string_view text) {
  if (text.find(',') == text.npos) return std::nullopt;
  std::string result(text);
  bool any = false;
  TextScanner words("", text);
  for (std::string_view word = words.Next(); !word.empty(); word = words.Next()) {
    if (IsNumberWith('.', word)) return std::nullopt;
    if (!IsNumberWith(',', word)) continue;
    result[static_cast<std::size_t>(word.data() - text.data()) + word.find(',')] = '.';
    any = true;
  }
  if (!any) return std::nullopt;
  return result;
}

// Of several roots, keeps the first with the most joints, and the order of its joints.
void KeepLargestTree(SourceMotion& motion) {
  const int joints = motion.NumJoints();
  std::vector<int> root(static_cast<std::size_t>(joints)), size(root.size(), 0);
  std::vector<std::string> roots;
  for (int j = 0; j < joints; ++j) {
    root[j] = motion.parents[j] < 0 ? j : root[motion.parents[j]];
    ++size[root[j]];
    if (motion.parents[j] < 0) roots.push_back(motion.joint_names[j]);
  }
  if (roots.size() < 2) return;
  const int kept = static_cast<int>(std::ranges::max_element(size) - size.begin());
  motion.notes.push_back(fmt::format(
      "{} roots: {}; '{}' is used, the first with the most joints ({}), the others are ignored",
      roots.size(), fmt::join(roots, ", "), motion.joint_names[kept], size[kept]));
  const int count = size[kept];  // a tree's joints follow its root
  const auto part = [&](const auto& all) {
    return std::vector(all.begin() + kept, all.begin() + kept + count);
  };
  std::vector<Eigen::Quaterniond> rotations;
  rotations.reserve(static_cast<std::size_t>(motion.NumFrames()) * count);
  for (int t = 0; t < motion.NumFrames(); ++t) {
    for (int j = kept; j < kept + count; ++j) rotations.push_back(motion.Rotation(t, j));
    motion.positions[t] = motion.positions[t].middleCols(kept, count).eval();
  }
  motion.rotations = std::move(rotations);
  motion.joint_names = part(motion.joint_names);
  motion.parents = part(motion.parents);
  for (int& parent : motion.parents) parent = std::max(parent - kept, -1);
  motion.rest_offsets = motion.rest_offsets.middleCols(kept, count).eval();
  std::erase_if(motion.end_sites,
                [&](const SourceMotion::EndSite& site) { return root[site.parent] != kept; });
  for (SourceMotion::EndSite& site : motion.end_sites) site.parent -= kept;
}

SourceMotion ParsePlain(std::string_view text, std::string name, double meters_per_unit) {
  TextScanner scanner(std::move(name), text);
  SourceMotion motion;
  motion.format = "BVH";
  const std::vector<Channel> channels = ReadHierarchy(scanner, meters_per_unit, motion);
  if (channels.empty()) {
    scanner.Fail("no joint has CHANNELS", "Export the motion with its channels");
  }
  scanner.Expect("MOTION", "after the hierarchy");
  scanner.Expect("Frames:", "number of frames");
  const int num_frames = scanner.Integer("the number of frames", 0, 100'000'000);
  if (num_frames == 0) scanner.Fail("holds no frames", "Export the motion, not only the skeleton");
  scanner.Expect("Frame", "\"Frame Time:\"");
  scanner.Expect("Time:", "\"Frame Time:\"");
  const double frame_time = scanner.Number("the frame time");
  if (frame_time < 1e-5 || frame_time > 100) {
    scanner.Fail(fmt::format("a frame time of {} s", frame_time),
                 "Write seconds per frame, for instance 0.0333333");
  }
  motion.frame_rate = 1 / frame_time;
  // Customary frame times are rounded ("0.0333333"); the rates they mean are whole numbers.
  const double whole = std::round(motion.frame_rate);
  if (whole > 0 && std::abs(motion.frame_rate - whole) < 2e-3 * whole) motion.frame_rate = whole;

  // The header's count is trusted only as far as the text allows: a number takes two bytes.
  const std::size_t bearable = text.size() / (2 * channels.size()) + 1;
  const std::size_t expected = std::min<std::size_t>(num_frames, bearable);
  CheckMemoryBudget(scanner, static_cast<double>(expected + 1), motion.NumJoints(), text.size());
  motion.positions.reserve(expected + 1);  // some files have one frame more than they state
  motion.rotations.reserve((expected + 1) * motion.joint_names.size());
  for (int frame = 0; frame < num_frames; ++frame) {
    // Exporters miscount, and clips are cut by hand: the whole frames that exist are accepted.
    if (frame > 0 && scanner.AtEnd()) {
      motion.notes.push_back(fmt::format(
          "the header announces {} frames, but the file has {}{}", num_frames, frame,
          frame < num_frames - 1 ? ": the motion was cut, or the file is incomplete" : ""));
      return motion;
    }
    ReadFrame(scanner, frame, num_frames, meters_per_unit, channels, motion);
  }
  if (!scanner.AtEnd()) {
    ReadFrame(scanner, num_frames, num_frames + 1, meters_per_unit, channels, motion);
    motion.notes.push_back(
        fmt::format("the header announces {} frames, but the file has one more", num_frames));
  }
  if (!scanner.AtEnd()) {
    scanner.Next();
    scanner.Fail(fmt::format("there are more numbers after the {} frames that the header announces",
                             num_frames),
                 "Correct 'Frames:', or the channels of the hierarchy");
  }
  return motion;
}

}  // namespace

SourceMotion ParseBvh(std::string_view text, std::string name, double meters_per_unit) {
  const std::optional<std::string> with_points = WithDecimalPoints(text);
  SourceMotion motion =
      ParsePlain(with_points ? *with_points : text, std::move(name), meters_per_unit);
  if (with_points) motion.notes.emplace_back("numbers have decimal commas: read as points");
  KeepLargestTree(motion);
  return motion;
}

SourceMotion ReadBvh(const std::filesystem::path& path, double meters_per_unit) {
  std::vector<std::string> notes;
  const std::string text = PlainText(ReadGzipText(path), notes);
  SourceMotion motion = ParseBvh(text, path.string(), meters_per_unit);
  motion.notes.insert(motion.notes.begin(), notes.begin(), notes.end());
  return motion;
}

namespace {

constexpr double kUnitsPerMeter = 100;
constexpr double kTurn = 2 * std::numbers::pi;
constexpr double kDegreesPerRadian = 180 / std::numbers::pi;

using Text = std::back_insert_iterator<std::string>;

// (z, x, y) with R = Rz(z) Rx(x) Ry(y); of all solutions, the one nearest to `previous`.
Eigen::Vector3d EulerZxy(const Eigen::Matrix3d& R, const Eigen::Vector3d& previous) {
  const double sine = std::clamp(R(2, 1), -1.0, 1.0);
  const double cosine = std::hypot(R(0, 1), R(1, 1));
  Eigen::Vector3d angles;
  angles[1] = std::atan2(sine, cosine);
  if (cosine > 1e-9) {
    angles[0] = std::atan2(-R(0, 1), R(1, 1));
    angles[2] = std::atan2(-R(2, 0), R(2, 2));
  } else {
    // Straight up or down, only z + y or z - y matters: y is kept, z takes the rest.
    angles[2] = previous[2];
    const double sum = std::atan2(R(1, 0), R(0, 0));
    angles[0] = sine > 0 ? sum - angles[2] : sum + angles[2];
  }
  const auto nearest = [&](Eigen::Vector3d candidate) {
    for (int c = 0; c < 3; ++c) {
      candidate[c] += kTurn * std::round((previous[c] - candidate[c]) / kTurn);
    }
    return candidate;
  };
  constexpr double kPi = std::numbers::pi;
  const Eigen::Vector3d one = nearest(angles);
  const Eigen::Vector3d other = nearest({angles[0] + kPi, kPi - angles[1], angles[2] + kPi});
  return (one - previous).squaredNorm() <= (other - previous).squaredNorm() ? one : other;
}

void WriteOffset(const Eigen::Vector3d& offset_m, const std::string& indent, Text out) {
  const Eigen::Vector3d offset = kUnitsPerMeter * offset_m;
  fmt::format_to(out, "{}OFFSET {:.6f} {:.6f} {:.6f}\n", indent, offset.x(), offset.y(),
                 offset.z());
}

// Writes a joint and its descendants, depth first, which gives the order of the channels.
void WriteJoint(const BodySurface& surface, int joint, int depth, std::vector<int>& order,
                Text out) {
  order.push_back(joint);
  const std::string indent(depth, '\t');
  const std::string inner(depth + 1, '\t');
  const int parent = kJointParents[joint];
  const Eigen::Matrix3Xd& rest = surface.RestJoints();
  fmt::format_to(out, "{}{} {}\n{}{{\n", indent, parent < 0 ? "ROOT" : "JOINT", kJointNames[joint],
                 indent);
  if (parent < 0) {
    // Programs differ in whether positions replace the offset or are added: zero fits both.
    WriteOffset(Eigen::Vector3d::Zero(), inner, out);
    fmt::format_to(
        out, "{}CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n", inner);
  } else {
    WriteOffset(rest.col(joint) - rest.col(parent), inner, out);
    fmt::format_to(out, "{}CHANNELS 3 Zrotation Xrotation Yrotation\n", inner);
  }
  bool is_leaf = true;
  for (int child = joint + 1; child < kNumJoints; ++child) {
    if (kJointParents[child] != joint) continue;
    is_leaf = false;
    WriteJoint(surface, child, depth + 1, order, out);
  }
  if (is_leaf) {
    fmt::format_to(out, "{}End Site\n{}{{\n", inner, inner);
    WriteOffset(EndSite(surface, joint), inner + '\t', out);
    fmt::format_to(out, "{}}}\n", inner);
  }
  fmt::format_to(out, "{}}}\n", indent);
}

}  // namespace

std::string BvhText(const Clip& clip, const BodySurface& surface) {
  std::string text = "HIERARCHY\n";
  const Text out = std::back_inserter(text);
  std::vector<int> order;
  WriteJoint(surface, 0, 0, order, out);
  fmt::format_to(out, "MOTION\nFrames: {}\nFrame Time: {:.9f}\n", clip.NumFrames(),
                 1 / clip.frame_rate);
  Eigen::Matrix3d y_up_from_z_up;
  y_up_from_z_up << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  Eigen::Matrix3Xd angles = Eigen::Matrix3Xd::Zero(3, kNumJoints);
  for (int t = 0; t < clip.NumFrames(); ++t) {
    const Eigen::Vector3d root =
        kUnitsPerMeter * y_up_from_z_up * (surface.RestJoints().col(0) + clip.trans.col(t));
    fmt::format_to(out, "{:.6f} {:.6f} {:.6f}", root.x(), root.y(), root.z());
    for (const int joint : order) {
      Eigen::Matrix3d R = ExpSO3(clip.pose[t].col(joint));
      if (joint == 0) R = y_up_from_z_up * R;
      angles.col(joint) = EulerZxy(R, angles.col(joint));
      const Eigen::Vector3d degrees = kDegreesPerRadian * angles.col(joint);
      fmt::format_to(out, " {:.6f} {:.6f} {:.6f}", degrees[0], degrees[1], degrees[2]);
    }
    text += '\n';
  }
  return text;
}

void WriteBvh(const Clip& clip, const BodySurface& surface, const std::filesystem::path& path) {
  WriteAtomically(path, BvhText(clip, surface));
}

}  // namespace holdfast
