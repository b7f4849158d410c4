// SPDX-License-Identifier: MIT
#include "geometry/report/report_data.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <tuple>

#include <fmt/format.h>

#include "geometry/clip/clip_arrays.h"
#include "geometry/clip/corrective_basis.h"
#include "geometry/error.h"
#include "geometry/mesh/decimate.h"
#include "geometry/mesh/mesh_topology.h"
#include "geometry/mesh/signed_distance.h"
#include "geometry/mesh/spheres.h"
#include "geometry/parallel.h"
#include "geometry/report/report_page.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

constexpr double kCorrectiveTolerance = 0.1e-3;  // meters: a tenth of a pixel in a close-up
constexpr int kMaxDirections = 64;
constexpr double kDistanceStep = 0.1e-3;  // meters per unit of `distance`
constexpr int kDistanceLimit = 127;
constexpr int kShownVertices = 40'000;  // limit for objects; scans have more than a page can handle
constexpr int kCheckedVertices = 24;
constexpr int kCheckedFrames = 6;

void AddPoints(ReportPayload& payload, std::string_view name, const Eigen::Matrix3Xd& points) {
  const Eigen::Matrix3Xf values = points.cast<float>();
  payload.Add(name, std::span<const float>(values.data(), static_cast<std::size_t>(values.size())),
              3);
}

// Ids in the smallest type that holds them.
void AddIds(ReportPayload& payload, std::string_view name, std::span<const int> ids, int stride,
            Eigen::Index limit) {
  if (limit <= 65536) {
    payload.Add(name, std::vector<std::uint16_t>(ids.begin(), ids.end()), stride);
  } else {
    payload.Add(name, std::vector<std::uint32_t>(ids.begin(), ids.end()), stride);
  }
}

void AddFaces(ReportPayload& payload, std::string_view name, const Eigen::Matrix3Xi& faces,
              Eigen::Index vertices) {
  AddIds(payload, name, {faces.data(), static_cast<std::size_t>(faces.size())}, 3, vertices);
}

void AddWeights(ReportPayload& payload, const BodySurface& surface) {
  std::vector<std::uint8_t> counts, joints;
  std::vector<float> values;
  for (int i = 0; i < surface.NumVertices(); ++i) {
    const auto weights = surface.Weights(i);
    counts.push_back(static_cast<std::uint8_t>(weights.size()));
    for (const auto& [joint, weight] : weights) {
      joints.push_back(static_cast<std::uint8_t>(joint));
      values.push_back(static_cast<float>(weight));
    }
  }
  payload.Add("weight_count", counts, 1);
  payload.Add("weight_joint", joints, 1);
  payload.Add("weight_value", values, 1);
}

// Directions in 16 bits each: error below a micrometer.
void AddCorrectives(ReportPayload& payload, const CorrectiveBasis& basis) {
  std::vector<std::int16_t> directions;
  std::vector<float> scales;
  directions.reserve(static_cast<std::size_t>(basis.directions.size()));
  for (Eigen::Index k = 0; k < basis.Size(); ++k) {
    const float scale = std::max(basis.directions.col(k).cwiseAbs().maxCoeff(), 1e-12f) / 32767.0f;
    scales.push_back(scale);
    for (const float value : basis.directions.col(k)) {
      directions.push_back(static_cast<std::int16_t>(std::lround(value / scale)));
    }
  }
  payload.Add("directions", directions, static_cast<int>(3 * basis.rest.cols()));
  payload.Add("direction_scale", scales, 1);
  payload.Add("coefficients",
              std::span<const float>(basis.coefficients.data(),
                                     static_cast<std::size_t>(basis.coefficients.size())),
              static_cast<int>(basis.Size()));
}

// Signed distances (meters, clamped to +-limit) of points from frame to frame. Points farther than
// `limit` from the object's box, or still that far given their last distance, need no query.
class DistancesWithin {
 public:
  DistancesWithin(const SignedDistance& object, std::size_t points, double limit)
      : object_(object), limit_(limit), last_(points, {Eigen::Vector3d::Zero(), 0.0, -1}) {}

  Eigen::VectorXd At(const Eigen::Matrix3Xd& points) {
    const bool closed = object_.IsWatertight();
    const Eigen::AlignedBox3d box(object_.Min(), object_.Max());
    Eigen::VectorXd distances(points.cols());
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      const Eigen::Vector3d point = points.col(i);
      auto& [place, distance, face] = last_[static_cast<std::size_t>(i)];
      if (box.squaredExteriorDistance(point) >= limit_ * limit_ ||
          (closed && face >= 0 && distance - (point - place).norm() >= limit_)) {
        distances(i) = limit_;
        continue;
      }
      const SignedDistance::Result nearest = object_.Query(point, face);
      place = point;
      distance = nearest.distance;
      face = nearest.face;
      distances(i) = std::clamp(distance, -limit_, limit_);
    }
    return distances;
  }

 private:
  const SignedDistance& object_;
  double limit_;
  std::vector<std::tuple<Eigen::Vector3d, double, int>> last_;  // place, distance, face or -1
};

// Data that varies per frame, and the vertices for the page's self-check.
struct Motion {
  std::vector<float> rotation, offset;    ///< (T,55,4), (T,55,3)
  std::vector<Eigen::Matrix3Xd> joints;   ///< per frame (3 x 55)
  std::vector<Eigen::VectorXd> distance;  ///< per frame: hand vertices to object, meters
  nlohmann::json check = nlohmann::json::array();
};

Motion Evaluate(const ReportInput& input, const BodySurface& surface,
                const std::vector<int>& hand_ids, int threads) {
  const Clip& clip = input.clip;
  const int frames = clip.NumFrames();
  const BodySurface hands(input.body, input.betas, hand_ids);
  std::optional<SignedDistance> object;
  if (input.object && clip.object) object.emplace(*input.object);

  Motion motion;
  motion.rotation.resize(static_cast<std::size_t>(frames) * kNumJoints * 4);
  motion.offset.resize(static_cast<std::size_t>(frames) * kNumJoints * 3);
  motion.joints.resize(frames);
  motion.distance.resize(frames);
  const auto evaluate = [&](int t, BodyState& state, std::optional<DistancesWithin>& within) {
    if (object) {
      Forward(hands, clip.pose[t], clip.trans.col(t), state);
      const Eigen::Matrix3d object_from_world = ExpSO3(clip.object->orient.col(t)).transpose();
      const Eigen::Matrix3Xd in_object =
          object_from_world * (state.vertices.colwise() - clip.object->trans.col(t));
      motion.distance[t] = within->At(in_object);
    } else {
      ForwardJoints(surface.RestJoints(), clip.pose[t], clip.trans.col(t), state);
    }
    motion.joints[t] = state.joints;
    for (int j = 0; j < kNumJoints; ++j) {
      const auto place = static_cast<std::size_t>(t) * kNumJoints + static_cast<std::size_t>(j);
      const Eigen::Quaternionf q(
          Eigen::Quaterniond(state.world_rotation[j]).normalized().cast<float>());
      std::copy_n(q.coeffs().data(), 4, motion.rotation.data() + 4 * place);
      const Eigen::Vector3f offset = state.skin_offset.col(j).cast<float>();
      std::copy_n(offset.data(), 3, motion.offset.data() + 3 * place);
    }
  };

  constexpr int kTogether = 16;
  ParallelFor((frames + kTogether - 1) / kTogether, threads, [&](int block) {
    BodyState state;
    std::optional<DistancesWithin> within;
    if (object) within.emplace(*object, hand_ids.size(), kDistanceLimit * kDistanceStep);
    const int end = std::min(frames, (block + 1) * kTogether);
    for (int t = block * kTogether; t < end; ++t) evaluate(t, state, within);
  });

  std::vector<int> checked;
  for (int k = 0; k < kCheckedVertices; ++k) {
    checked.push_back(k * (surface.NumVertices() - 1) / (kCheckedVertices - 1));
  }
  checked.insert(checked.end(), {hand_ids.front(), hand_ids[hand_ids.size() / 2], hand_ids.back()});
  const BodySurface probe(input.body, input.betas, checked);
  BodyState state;
  for (int k = 0; k < std::min(kCheckedFrames, frames); ++k) {
    const int t = frames == 1 ? 0 : k * (frames - 1) / (std::min(kCheckedFrames, frames) - 1);
    Forward(probe, clip.pose[t], clip.trans.col(t), state);
    for (std::size_t i = 0; i < checked.size(); ++i) {
      const Eigen::Vector3d v = state.vertices.col(static_cast<Eigen::Index>(i));
      motion.check.push_back({t, checked[i], v.x(), v.y(), v.z()});
    }
  }
  return motion;
}

// Quantized, as differences from frame to frame, which are mostly zero for a firm grasp.
void AddDistances(ReportPayload& payload, const std::vector<Eigen::VectorXd>& distance) {
  std::vector<std::int8_t> values;
  std::vector<std::uint8_t> previous(static_cast<std::size_t>(distance.front().size()), 0);
  for (const Eigen::VectorXd& frame : distance) {
    for (Eigen::Index i = 0; i < frame.size(); ++i) {
      const double units =
          std::clamp<double>(std::round(frame(i) / kDistanceStep), -kDistanceLimit, kDistanceLimit);
      const auto byte = static_cast<std::uint8_t>(static_cast<std::int8_t>(units));
      values.push_back(static_cast<std::int8_t>(
          static_cast<std::uint8_t>(byte - previous[static_cast<std::size_t>(i)])));
      previous[static_cast<std::size_t>(i)] = byte;
    }
  }
  payload.Add("distance", values, static_cast<int>(distance.front().size()));
}

// The displayed object: decimated if it is a scan with more vertices than a page can handle.
TriangleMesh Shown(const TriangleMesh& object, std::vector<std::string>& notes) {
  if (object.NumVertices() <= kShownVertices) return object;
  try {
    DecimateOptions options;
    options.vertices = kShownVertices;
    options.samples = 0;
    TriangleMesh shown = Decimate(object, options).mesh;
    notes.push_back(fmt::format(
        "The object is shown with {} of its {} vertices; distances are computed with all of them.",
        shown.NumVertices(), object.NumVertices()));
    return shown;
  } catch (const Error&) {
    return object;  // cannot be simplified: the file is larger then
  }
}

// Unit vectors with 16 bits per component.
void AddNormals(ReportPayload& payload, std::string_view name, const Eigen::Matrix3Xd& normals) {
  std::vector<std::int16_t> values;
  for (const double value : normals.reshaped()) {
    values.push_back(static_cast<std::int16_t>(std::lround(32767.0 * value)));
  }
  payload.Add(name, values, 3);
}

// A rigid mesh and its track: NAME_vertices, NAME_normals, NAME_faces, NAME_pose.
void AddTracked(ReportPayload& payload, const std::string& name, const TriangleMesh& mesh,
                const ObjectTrack& track, std::vector<std::string>& notes) {
  const ShadedMesh shaded = SplitAtCreases(Shown(mesh, notes));
  const TriangleMesh& shown = shaded.mesh;
  AddPoints(payload, name + "_vertices", shown.vertices);
  AddNormals(payload, name + "_normals", shaded.normals);
  AddFaces(payload, name + "_faces", shown.faces, shown.NumVertices());
  std::vector<float> pose;
  for (Eigen::Index t = 0; t < track.trans.cols(); ++t) {
    const Eigen::Quaternionf q(Eigen::Quaterniond(ExpSO3(track.orient.col(t))).cast<float>());
    const Eigen::Vector3f trans = track.trans.col(t).cast<float>();
    pose.insert(pose.end(), q.coeffs().data(), q.coeffs().data() + 4);
    pose.insert(pose.end(), trans.data(), trans.data() + 3);
  }
  payload.Add(name + "_pose", pose, 7);
}

// What stands in the world: goals (of a moving one, one per second), and the input's own marker.
TriangleMesh MarkerOf(const ReportInput& input) {
  constexpr double kGoalRadius = 0.04;  // meters
  const Eigen::MatrixXd goals = GoalsIn(input.metrics);
  TriangleMesh marker;
  if (goals.cols() > 1) {
    const auto every = std::max<Eigen::Index>(1, std::lround(input.clip.frame_rate));
    marker = Spheres(goals(Eigen::all, Eigen::seq(0, Eigen::last, every)), kGoalRadius, 4);
  } else if (goals.size() > 0) {
    marker = Spheres(goals.reshaped(3, goals.size() / 3), kGoalRadius, 4);
  }
  if (input.marker) Append(*input.marker, marker);
  return marker;
}

struct HandContact {
  std::vector<double> ratio;     ///< fraction of the hand's vertices in contact
  std::vector<double> depth_mm;  ///< of the deepest vertex inside
  bool meets = false;            ///< whether the hand meets the object in any frame
};

HandContact ContactOf(const std::vector<Eigen::VectorXd>& distance, Eigen::Index begin,
                      Eigen::Index count, double threshold_m) {
  HandContact contact;
  for (const Eigen::VectorXd& frame : distance) {
    const auto hand = frame.segment(begin, count);
    const auto touching = (hand.array().abs() < threshold_m).count();
    const double depth = std::max(0.0, -hand.minCoeff());
    contact.ratio.push_back(static_cast<double>(touching) / static_cast<double>(count));
    contact.depth_mm.push_back(1e3 * depth);
    contact.meets = contact.meets || touching > 0 || depth > 0.0;
  }
  return contact;
}

// Norm of the derivative by central differences, one-sided at the ends.
template <typename PointAt>
std::vector<double> SpeedOf(int frames, double frame_rate, const PointAt& point_at) {
  std::vector<double> speed;
  for (int t = 0; t < frames; ++t) {
    const int a = std::max(0, t - 1);
    const int b = std::min(frames - 1, t + 1);
    const double length = (point_at(b) - point_at(a)).norm();
    speed.push_back(b > a ? length * frame_rate / (b - a) : 0.0);
  }
  return speed;
}

// Numbers (booleans as 0 and 1), one per frame; other values in a file are not curves.
bool IsCurve(const nlohmann::json& values, int frames) {
  return values.is_array() && static_cast<int>(values.size()) == frames &&
         std::ranges::all_of(values, [](const nlohmann::json& value) {
           return value.is_number() || value.is_boolean() || value.is_null();
         });
}

// Given frames were not solved, so they have no iteration count.
void LeaveOutGiven(const nlohmann::json& per_frame, nlohmann::json& series) {
  const auto stop = per_frame.find("stop");
  if (stop == per_frame.end() || !stop->is_array() || !series.contains("iterations")) return;
  nlohmann::json& iterations = series["iterations"];
  for (std::size_t t = 0; t < std::min(stop->size(), iterations.size()); ++t) {
    if ((*stop)[t] == "given") iterations[t] = nullptr;
  }
}

// Curves by name (units in the names), one value per frame: all of metrics.json, and the speed and
// height of wrists, hips and object. If metrics.json has none, also contact (closer than
// `contact_threshold_mm`) and penetration from `distance` (per frame, meters: vertices of the right
// hand, then of the left; empty without an object).
nlohmann::json SeriesOf(const ReportInput& input, const std::vector<Eigen::Matrix3Xd>& joints,
                        const std::vector<Eigen::VectorXd>& distance, int right_hand_vertices,
                        double contact_threshold_mm) {
  const Clip& clip = input.clip;
  const int frames = clip.NumFrames();
  nlohmann::json series = nlohmann::json::object();
  if (input.metrics.is_object() && input.metrics.contains("per_frame") &&
      input.metrics["per_frame"].is_object()) {
    for (const auto& [name, values] : input.metrics["per_frame"].items()) {
      if (IsCurve(values, frames)) series[name] = values;
    }
    LeaveOutGiven(input.metrics["per_frame"], series);
  }
  if (!distance.empty() && distance[0].size() > 0 && !series.contains("contact_ratio")) {
    const double threshold = 1e-3 * contact_threshold_mm;
    const Eigen::Index left = distance[0].size() - right_hand_vertices;
    const HandContact hands[] = {ContactOf(distance, 0, right_hand_vertices, threshold),
                                 ContactOf(distance, right_hand_vertices, left, threshold)};
    // For one hand, the names of a fit's metrics; for two, each its own.
    const bool both = hands[0].meets && hands[1].meets;
    for (int k = 0; k < 2; ++k) {
      if (!hands[k].meets && (k == 1 || hands[1].meets)) continue;
      const std::string side = !both ? "" : k == 0 ? "right_" : "left_";
      series[both ? side + "hand_contact_ratio" : "contact_ratio"] = hands[k].ratio;
      series[side + "hand_in_object_mm"] = hands[k].depth_mm;  // one-sided
    }
  }
  const auto add_motion = [&](const std::string& name, const auto& point_at) {
    series[name + "_speed_m_s"] = SpeedOf(frames, clip.frame_rate, point_at);
    for (int t = 0; t < frames; ++t) series[name + "_height_m"].push_back(point_at(t).z());
  };
  const auto joint = [&](int j) {
    return [&joints, j](int t) -> Eigen::Vector3d { return joints[t].col(j); };
  };
  const std::optional<Side> lone = input.body->LoneHand();
  if (lone != Side::kLeft) add_motion("right_wrist", joint(WristJoint(Side::kRight)));
  if (lone != Side::kRight) add_motion("left_wrist", joint(WristJoint(Side::kLeft)));
  if (!lone) add_motion("hips", joint(0));
  if (clip.object) {
    add_motion("object", [&](int t) -> Eigen::Vector3d { return clip.object->trans.col(t); });
  }
  return series;
}

std::string ShapeText(const ReportInput& input) {
  const bool mean = input.betas.size() == 0 || input.betas.isZero(0.0);
  return mean ? "mean" : fmt::format("{} coefficients of the clip", input.betas.size());
}

// Description of a clip as text: [[name, value], ...].
nlohmann::json FactsOf(const ReportInput& input, const BodySurface& surface,
                       const CorrectiveBasis& basis) {
  const Clip& clip = input.clip;
  nlohmann::json facts = nlohmann::json::array();
  const auto add = [&](const char* name, std::string value) {
    facts.push_back({name, std::move(value)});
  };
  add("Clip", input.source);
  add("Length", fmt::format("{} frames at {:g} Hz, {:.2f} s", clip.NumFrames(), clip.frame_rate,
                            clip.NumFrames() / clip.frame_rate));
  add("Body model", fmt::format("{}, {} vertices, {} faces", input.body->Name(),
                                surface.NumVertices(), surface.Faces().cols()));
  add("Body shape", ShapeText(input));
  add("Surface shown", fmt::format("within {:.2f} mm of the body model ({} directions of pose "
                                   "correctives)",
                                   1e3 * basis.max_error_m, basis.Size()));
  if (clip.object) add("Object", clip.object->name.empty() ? "unnamed" : clip.object->name);
  if (input.object) {
    const Eigen::Vector3d size = 1e3 * Extent(*input.object);
    add("Object mesh", fmt::format("{} vertices, {} faces", input.object->NumVertices(),
                                   input.object->NumFaces()));
    add("Object size", fmt::format("{:.0f} x {:.0f} x {:.0f} mm", size.x(), size.y(), size.z()));
  }
  return facts;
}

// Caveats that a viewer must know to interpret the picture, one sentence each.
std::vector<std::string> NotesOf(const ReportInput& input) {
  std::vector<std::string> notes;
  const bool matters = input.object || !input.clip.betas.isZero(0.0);
  if (input.foreign_body && matters) {
    notes.push_back(
        fmt::format("The clip was made with another body model ({}) than the one shown ({}): the "
                    "clip's body shape is not shown, and contact can be off by centimeters.",
                    input.made_with == "SMPL-X" ? "SMPL-X, " + input.clip.gender : input.made_with,
                    input.body->Name()));
  }
  if (!input.object_missing.empty()) {
    notes.push_back("The object is not shown: " + input.object_missing);
  }
  for (const char* key : {"notes", "warnings"}) {
    if (!input.metrics.is_object() || !input.metrics.contains(key)) continue;
    for (const nlohmann::json& note : input.metrics[key]) {
      if (note.is_string()) notes.push_back(note.get<std::string>());
    }
  }
  return notes;
}

}  // namespace

ReportClip MakeReportClip(const ReportInput& input, double contact_threshold_mm, int threads) {
  const Clip& clip = input.clip;
  const BodySurface surface = input.Surface();
  const int vertices = surface.NumVertices();
  std::vector<int> hand_ids = input.body->HandVertexIds(Side::kRight);
  const int right_hand = static_cast<int>(hand_ids.size());
  const std::vector<int>& left_ids = input.body->HandVertexIds(Side::kLeft);
  hand_ids.insert(hand_ids.end(), left_ids.begin(), left_ids.end());

  CorrectiveBasis basis;
  Motion motion;
  // In parallel, since each has single-threaded phases.
  ParallelFor(2, threads, [&](int part) {
    if (part == 0) {
      basis = ComputeCorrectiveBasis(surface, clip, kCorrectiveTolerance, kMaxDirections, threads);
    } else {
      motion = Evaluate(input, surface, hand_ids, threads);
    }
  });

  ReportClip report;
  report.directions = static_cast<int>(basis.Size());
  report.surface_error_mm = 1e3 * basis.max_error_m;
  ReportPayload& payload = report.payload;
  AddPoints(payload, "rest", basis.rest);
  AddFaces(payload, "faces", surface.Faces(), vertices);
  AddCorrectives(payload, basis);
  AddWeights(payload, surface);
  payload.Add("joint_rotation", motion.rotation, 4 * kNumJoints);
  payload.Add("joint_offset", motion.offset, 3 * kNumJoints);
  AddPoints(payload, "joint_rest", surface.RestJoints());
  AddIds(payload, "hand_vertices", hand_ids, 1, vertices);
  std::vector<std::string> notes = NotesOf(input);
  const bool has_object = input.object && clip.object;
  if (has_object) {
    AddDistances(payload, motion.distance);
    AddTracked(payload, "object", *input.object, *clip.object, notes);
  }

  const TriangleMesh* const table = TableMesh(clip);
  if (table != nullptr) AddTracked(payload, "table", *table, *clip.table, notes);
  const TriangleMesh marker = MarkerOf(input);
  if (marker.NumFaces() > 0) {
    AddPoints(payload, "marker_vertices", marker.vertices);
    AddFaces(payload, "marker_faces", marker.faces, marker.NumVertices());
  }

  report.header = {
      {"name", ReportName(input)},
      {"source", input.source},
      {"frames", clip.NumFrames()},
      {"frame_rate", clip.frame_rate},
      {"vertices", vertices},
      {"right_hand_vertices", right_hand},
      {"has_object", has_object},
      {"has_table", table != nullptr},
      {"has_marker", marker.NumFaces() > 0},
      {"object_name", clip.object ? clip.object->name : ""},
      {"holding", clip.holding_hand},
      {"contact_threshold_mm", contact_threshold_mm},
      {"surface_error_mm", report.surface_error_mm},
      {"series", SeriesOf(input, motion.joints, motion.distance, right_hand, contact_threshold_mm)},
      {"facts", FactsOf(input, surface, basis)},
      {"notes", notes},
      {"check", motion.check},
      {"arrays", payload.Directory()}};
  if (input.metrics.is_object()) {
    report.header["metrics"] = input.metrics;
    report.header["metrics"].erase("per_frame");  // already in `series`
  }
  return report;
}

Eigen::MatrixXd GoalsIn(const nlohmann::json& metrics) {
  std::vector<nlohmann::json> points;
  bool moves = false;
  try {
    if (const auto goals = metrics.find("goals"); goals != metrics.end()) {
      for (const nlohmann::json& goal : *goals) points.push_back(goal.at("goal_m"));
    } else if (metrics.contains("/per_frame/goal_m"_json_pointer)) {
      points = metrics["per_frame"]["goal_m"];
      moves = true;
    } else if (metrics.contains("/options/places_m"_json_pointer)) {
      points = metrics["options"]["places_m"];
      if (!points.empty()) points.erase(points.begin());  // where the object is taken
    }
    Eigen::MatrixXd goals(3, points.size());
    for (std::size_t g = 0; g < points.size(); ++g) {
      for (std::size_t k = 0; k < 3; ++k) goals(k, g) = points[g].at(k).get<double>();
    }
    return moves ? goals : Eigen::MatrixXd(goals.reshaped());
  } catch (const nlohmann::json::exception& error) {
    throw Error("metrics.json", fmt::format("its goals are unreadable: {}", error.what()),
                "Delete it, or generate it again");
  }
}

std::string ReportName(const ReportInput& input) {
  namespace fs = std::filesystem;
  if (input.file.empty()) return input.source;
  if (input.file.filename() != "clip.npz") return input.file.stem().string();
  const std::string folder = fs::absolute(input.file).parent_path().filename().string();
  return folder.empty() ? "clip" : folder;
}

}  // namespace holdfast
