// SPDX-License-Identifier: MIT
#include "solver/grasp/grasp_set_output.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace holdfast {
namespace {

constexpr int kFromThumb[kNumFingers] = {kThumb, kIndex, kMiddle, kRing, kPinky};

template <typename T>
NpyArray ArrayOf(char kind, std::vector<std::size_t> shape, const std::vector<T>& values) {
  NpyArray array;
  array.kind = kind;
  array.item_size = sizeof(T);
  array.shape = std::move(shape);
  array.data.resize(values.size() * sizeof(T));
  if (!values.empty()) std::memcpy(array.data.data(), values.data(), array.data.size());
  return array;
}

NpyArray Floats64(std::vector<std::size_t> shape, const std::vector<double>& values) {
  return ArrayOf('f', std::move(shape), values);
}

// UCS-4, padded with zeros to the longest.
NpyArray Texts(std::vector<std::size_t> shape, const std::vector<std::string>& values) {
  std::size_t longest = 1;
  for (const std::string& value : values) longest = std::max(longest, value.size());
  std::vector<std::uint32_t> letters(longest * values.size(), 0);
  for (std::size_t i = 0; i < values.size(); ++i) {
    std::copy(values[i].begin(), values[i].end(), letters.begin() + longest * i);
  }
  NpyArray array = ArrayOf('U', std::move(shape), letters);
  array.item_size = 4 * longest;
  return array;
}

struct Quality {
  const char* name;
  double (*value)(const CertifiedGrasp&);
};

// Numbers of one grasp: columns of the table, arrays of the archive.
constexpr Quality kQualities[] = {
    {"score", [](const CertifiedGrasp& g) { return g.grasp.score; }},
    {"least_friction",
     [](const CertifiedGrasp& g) {
       return g.grasp.certificate && g.grasp.certificate->least_friction
                  ? *g.grasp.certificate->least_friction
                  : std::numeric_limits<double>::infinity();
     }},
    {"ball_lower",
     [](const CertifiedGrasp& g) {
       return g.grasp.certificate ? g.grasp.certificate->ball_lower : 0.0;
     }},
    {"ball_upper",
     [](const CertifiedGrasp& g) {
       return g.grasp.certificate ? g.grasp.certificate->ball_upper : 0.0;
     }},
    {"wrench_quality", [](const CertifiedGrasp& g) { return g.grasp.wrench_quality; }},
    {"skin_in_object_mm", [](const CertifiedGrasp& g) { return g.grasp.max_penetration_mm; }},
    {"object_in_hand_mm", [](const CertifiedGrasp& g) { return g.grasp.object_in_hand_mm; }},
    {"fingers_in_each_other_mm",
     [](const CertifiedGrasp& g) { return g.grasp.self_penetration_mm; }},
    {"limit_excess_deg", [](const CertifiedGrasp& g) { return g.grasp.limit_excess_deg; }},
};

void AddContacts(const GraspSet& set, std::map<std::string, NpyArray>& arrays) {
  std::vector<std::int64_t> grasp;
  std::vector<double> points, normals;
  for (std::size_t i = 0; i < set.grasps.size(); ++i) {
    for (const GraspContact& contact : set.grasps[i].contacts) {
      grasp.push_back(static_cast<std::int64_t>(i));
      points.insert(points.end(), contact.point.begin(), contact.point.end());
      for (const double x : contact.inward) normals.push_back(-x);
    }
  }
  const std::size_t count = grasp.size();
  arrays["contact_grasp"] = ArrayOf('i', {count}, grasp);
  arrays["contact_point_object"] = Floats64({count, 3}, points);
  arrays["contact_normal_object"] = Floats64({count, 3}, normals);
}

}  // namespace

std::map<std::string, NpyArray> GraspSetArrays(const GraspSet& set, const std::string& object,
                                               Side side) {
  std::vector<double> wrist, object_pose, fingers, friction, length;
  std::vector<std::string> styles;
  std::vector<std::uint8_t> touching, palm;
  const auto add_pose = [](const Eigen::Isometry3d& pose, std::vector<double>& rows) {
    for (int r = 0; r < 4; ++r) {
      for (int c = 0; c < 4; ++c) rows.push_back(pose.matrix()(r, c));
    }
  };
  for (const auto& [grasp, contacts] : set.grasps) {
    add_pose(grasp.wrist_from_object, wrist);
    add_pose(grasp.wrist_from_object.inverse(), object_pose);
    fingers.insert(fingers.end(), grasp.fingers.data(), grasp.fingers.data() + 45);
    styles.emplace_back(StyleName(grasp.style));
    for (const int finger : kFromThumb) touching.push_back(grasp.fingers_touching[finger]);
    palm.push_back(grasp.palm_touching);
    friction.push_back(grasp.certificate ? grasp.certificate->friction : 0.0);
    length.push_back(grasp.certificate ? grasp.certificate->length_m : 0.0);
  }
  const std::size_t count = set.grasps.size();
  std::map<std::string, NpyArray> arrays;
  arrays["object_name"] = Texts({}, {object});
  arrays["hand"] = Texts({}, {std::string(SideName(side))});
  arrays["mass_center"] = Floats64({3}, {set.mass_center.begin(), set.mass_center.end()});
  arrays["wrist_from_object"] = Floats64({count, 4, 4}, wrist);
  arrays["object_from_wrist"] = Floats64({count, 4, 4}, object_pose);
  arrays["finger_pose"] = Floats64({count, 45}, fingers);
  arrays["style"] = Texts({count}, styles);
  arrays["fingers_touching"] = ArrayOf('b', {count, kNumFingers}, touching);
  arrays["palm_touching"] = ArrayOf('b', {count}, palm);
  arrays["friction"] = Floats64({count}, friction);
  arrays["ball_length"] = Floats64({count}, length);
  for (const Quality& quality : kQualities) {
    std::vector<double> values;
    for (const CertifiedGrasp& grasp : set.grasps) values.push_back(quality.value(grasp));
    arrays[quality.name] = Floats64({count}, values);
  }
  AddContacts(set, arrays);
  return arrays;
}

std::string GraspSetCsv(const GraspSet& set) {
  std::string text = "grasp,style,fingers,palm,contacts";
  for (const Quality& quality : kQualities) text += fmt::format(",{}", quality.name);
  text += ",wrist_x_m,wrist_y_m,wrist_z_m,wrist_qw,wrist_qx,wrist_qy,wrist_qz\n";
  for (std::size_t i = 0; i < set.grasps.size(); ++i) {
    const CertifiedGrasp& one = set.grasps[i];
    const auto& touching = one.grasp.fingers_touching;
    text += fmt::format("{},{},{},{},{}", i, StyleName(one.grasp.style),
                        std::count(touching.begin(), touching.end(), true),
                        one.grasp.palm_touching ? 1 : 0, one.contacts.size());
    for (const Quality& quality : kQualities) text += fmt::format(",{:.6g}", quality.value(one));
    const Eigen::Isometry3d wrist = one.grasp.wrist_from_object.inverse();
    const Eigen::Quaterniond q(wrist.linear());
    text +=
        fmt::format(",{:.6f},{:.6f},{:.6f},{:.6f},{:.6f},{:.6f},{:.6f}\n", wrist.translation().x(),
                    wrist.translation().y(), wrist.translation().z(), q.w(), q.x(), q.y(), q.z());
  }
  return text;
}

}  // namespace holdfast
