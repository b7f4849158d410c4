// SPDX-License-Identifier: MIT
#include "solver/grasp/grasp_set.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <numeric>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/error.h"
#include "solver/grasp/grasp_stages.h"

namespace holdfast {
namespace {

constexpr int kPlacesAtOnce = 16;  // placed before hands are closed there
// Closed and refined before distinctness is checked; fewer if fewer grasps are missing.
constexpr int kFewestAtOnce = 16, kMaxAtOnce = 64;

// One call of FindGrasps.
class GraspSampler : GraspStages {
 public:
  GraspSampler(const HandModel& hand, const TriangleMesh& object, const DistanceGrid& distance,
               const GraspSetOptions& options, const GraspProgress& progress, GraspSet& set)
      : GraspStages(hand, object, distance, options.search, progress), set_(options), out_(set) {}

  void Run() {
    const auto start = std::chrono::steady_clock::now();
    out_.mass_center = scene_.centroid;
    if (options_.place) out_.status = GraspStatus::kNothingAtPlace;
    if (options_.style == GraspStyle::kHandle) out_.status = GraspStatus::kNoHandle;
    for (int sampling = 0; sampling < set_.samplings; ++sampling) {
      const std::size_t before = out_.grasps.size();
      if (!Sample(sampling)) break;
      if (50 * (out_.grasps.size() - before) < out_.grasps.size() || out_.grasps.empty()) break;
    }
    if (out_.grasps.empty() && !stopped_) KeepLoose();
    std::ranges::stable_sort(out_.grasps, std::greater(),
                             [](const CertifiedGrasp& one) { return one.grasp.score; });
    if (!out_.grasps.empty()) {
      const bool enough = static_cast<int>(out_.grasps.size()) == set_.count;
      out_.status = enough ? GraspStatus::kFound : GraspStatus::kFewer;
    }
    if (stopped_) out_.status = GraspStatus::kStopped;
    out_.milliseconds =
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  }

 private:
  struct Trial {
    bool refined = false;
    std::optional<CertifiedGrasp> valid;  // without its certificate
    bool firm = false;                    // HoldsFirmly
  };

  // Whether a hand suits the requested use, if any: kForgiven is the score it may lose by where it
  // touches, what it covers and its orientation.
  bool FitsUse(HandEvaluation& evaluation, const GraspAttempt& attempt,
               const std::vector<GraspContact>& contacts) const {
    constexpr double kForgiven = 0.5;
    if (!options_.use || scene_.use.kind == GraspUse::kAny) return true;
    if (scene_.use.kind == GraspUse::kHandle && !scene_.handles.empty()) {
      return attempt.style == GraspStyle::kHandle;
    }
    const FingerPose fingers = anatomy_.axes.PoseOf(attempt.angles);
    const Eigen::Isometry3d object_from_wrist = attempt.wrist_from_object.inverse();
    const Eigen::Matrix3d turn = object_from_wrist.linear();
    return scene_.use.PlaceScore(contacts, object_from_wrist * evaluation.At(fingers).Vertices()) +
               scene_.use.DirectionScore(turn * anatomy_.axes.Across(),
                                         turn * anatomy_.axes.Forward(),
                                         turn * anatomy_.axes.PalmNormal()) >
           -kForgiven;
  }

  // Open hands at the places, most promising first, without those near a better one or an existing
  // grasp. False if the search is to stop.
  bool PlaceHands(std::span<const int> places, std::vector<Placement>& distinct) {
    std::vector<std::vector<Placement>> placed(places.size());
    if (!RunStage(Share(), 0.0, static_cast<int>(places.size()),
                  [&](int i) { placed[i] = PlaceAt(places[i]); })) {
      return false;
    }
    std::vector<Placement> queue;
    for (const std::vector<Placement>& placements : placed) {
      out_.placements += static_cast<int>(placements.size());
      for (const Placement& placement : placements) {
        if (!options_.style || placement.style == *options_.style) queue.push_back(placement);
      }
    }
    std::ranges::stable_sort(queue, std::greater(), &Placement::prior);
    for (const Placement& placement : queue) {
      const auto near = [&](const Placement& other) {
        return !AreDistinct(placement.wrist_from_object, other.wrist_from_object, set_.apart_m,
                            set_.apart_rad);
      };
      if (IsNew(placement.wrist_from_object, out_.grasps) && std::ranges::none_of(distinct, near)) {
        distinct.push_back(placement);
      }
    }
    return true;
  }

  // Closes, refines and assesses one hand.
  Trial Try(const Placement& placement) const {
    HandEvaluation evaluation = at_wrist_;
    auto [attempt, thumb_touches] = Close(placement, evaluation);
    CertifiedGrasp found;
    const auto holds = [&] {
      found.contacts =
          Contacts(evaluation, anatomy_.axes.PoseOf(attempt.angles), attempt.wrist_from_object);
      return FitsUse(evaluation, attempt, found.contacts) && Holds(found.contacts);
    };
    if (!thumb_touches || !holds()) return {};
    // A grasp that is sound except for an edge or thin wall in the skin is refined to push that
    // out.
    const FindIntrusions find_intrusions = [&](const Eigen::Matrix3Xd& vertices,
                                               const Eigen::Isometry3d& wrist_from_object) {
      std::vector<Intrusion> intrusions;
      for (ClosedHands::Inside& in : scene_.hands.FindInside(
               vertices, wrist_from_object * scene_.surface, scene_.surface_patches)) {
        if (*std::ranges::max_element(in.over.corners) >= hand_.NumVertices()) continue;
        in.over.point = wrist_from_object.inverse() * in.over.point;
        intrusions.push_back(in.over);
      }
      return intrusions;
    };
    const double most_mm = 1000.0 * set_.max_penetration_m;
    RefinementOptions once;
    once.rounds = 1;
    for (const bool again : {false, true}) {
      RefineGrasp(anatomy_, evaluation, distance_, once, attempt.angles, attempt.wrist_from_object,
                  again ? find_intrusions : FindIntrusions());
      if (!holds()) return {true, std::nullopt};
      found.grasp = Assess(scene_, evaluation, attempt, true);
      if (found.grasp.max_penetration_mm >= most_mm || !WhyRefused(scene_, found.grasp).empty()) {
        return {true, std::nullopt};
      }
      if (found.grasp.object_in_hand_mm < most_mm) {
        const bool firm = HoldsFirmly(found.contacts);
        return {true, std::move(found), firm};
      }
    }
    return {true, std::nullopt};
  }

  bool IsNew(const Eigen::Isometry3d& wrist_from_object,
             const std::vector<CertifiedGrasp>& among) const {
    return std::ranges::all_of(among, [&](const CertifiedGrasp& other) {
      return AreDistinct(wrist_from_object, other.grasp.wrist_from_object, set_.apart_m,
                         set_.apart_rad);
    });
  }

  double Share() const { return static_cast<double>(out_.grasps.size()) / set_.count; }
  // False when there are enough grasps or the search is to stop.
  bool Sample(int sampling) {
    FindPlaces(4 * OppositionOptions{}.samples, std::numeric_limits<int>::max(),
               options_.seed + static_cast<std::uint64_t>(sampling), sampling == 0);
    out_.use = scene_.use.kind;
    ++out_.samplings;
    // Handles come first, and only once.
    const auto around = static_cast<int>(oppositions_.size());
    std::vector<int> places(around + (sampling == 0 ? scene_.handles.size() : 0));
    std::iota(places.begin(), places.end(), 0);
    std::rotate(places.begin(), places.begin() + around, places.end());
    if (!places.empty() && out_.status == GraspStatus::kNothingToGrasp) {
      out_.status = GraspStatus::kNoRoom;
    }
    for (std::size_t begin = 0; begin < places.size(); begin += kPlacesAtOnce) {
      const std::size_t count = std::min<std::size_t>(kPlacesAtOnce, places.size() - begin);
      std::vector<Placement> placements;
      if (!PlaceHands({places.data() + begin, count}, placements)) return false;
      if (!placements.empty()) out_.status = GraspStatus::kNoCleanGrasp;
      if (!CloseAndKeep(placements)) return false;
    }
    return true;
  }

  bool CloseAndKeep(std::span<const Placement> placements) {
    while (!placements.empty()) {
      const int missing = set_.count - static_cast<int>(out_.grasps.size());
      const auto count = static_cast<int>(std::min<std::size_t>(
          std::clamp(2 * missing, kFewestAtOnce, kMaxAtOnce), placements.size()));
      std::vector<Trial> trials(count);
      if (!RunStage(Share(), 0.0, count, [&](int i) { trials[i] = Try(placements[i]); })) {
        return false;
      }
      placements = placements.subspan(count);
      out_.closings += count;
      const std::size_t before = out_.grasps.size();
      for (Trial& trial : trials) {
        out_.refinements += trial.refined;
        std::vector<CertifiedGrasp>& kept = trial.firm ? out_.grasps : loose_;
        if (static_cast<int>(kept.size()) < set_.count && trial.valid &&
            IsNew(trial.valid->grasp.wrist_from_object, kept)) {
          kept.push_back(std::move(*trial.valid));
        }
      }
      const auto kept = static_cast<int>(out_.grasps.size() - before);
      if (!RunStage(Share(), 0.0, kept, [&](int i) {
            CertifiedGrasp& one = out_.grasps[before + i];
            one.grasp.certificate = Certify(one.contacts);
          })) {
        out_.grasps.resize(before);
        return false;
      }
      if (static_cast<int>(out_.grasps.size()) == set_.count) return false;
    }
    return true;
  }

  // Keeps grasps that hold, but not firmly, if none is firm.
  void KeepLoose() {
    out_.grasps = std::move(loose_);
    for (CertifiedGrasp& one : out_.grasps) one.grasp.certificate = Certify(one.contacts);
  }

  const GraspSetOptions& set_;
  GraspSet& out_;
  std::vector<CertifiedGrasp> loose_;  // valid but not firm
};

}  // namespace

bool AreDistinct(const Eigen::Isometry3d& wrist_from_object, const Eigen::Isometry3d& other,
                 double apart_m, double apart_rad) {
  const Eigen::Matrix3d turn = wrist_from_object.linear().transpose() * other.linear();
  if (0.5 * (turn.trace() - 1.0) <= std::cos(apart_rad)) return true;
  const auto wrist = [](const Eigen::Isometry3d& pose) {
    return Eigen::Vector3d(pose.linear().transpose() * pose.translation());
  };
  return (wrist(wrist_from_object) - wrist(other)).norm() >= apart_m;
}

GraspSet FindGrasps(const HandModel& hand, const TriangleMesh& object, const DistanceGrid& distance,
                    const GraspSetOptions& options, const GraspProgress& progress) {
  const auto require = [](bool valid, const char* what, const char* instead) {
    if (!valid) throw Error("grasps", what, instead);
  };
  require(options.count > 0, "no grasp is requested", "Request at least one");
  require(options.apart_m >= 0.0 && options.apart_rad >= 0.0 && options.max_penetration_m > 0.0,
          "distances or angles are not positive", "Use the defaults of GraspSetOptions");
  if (const std::string why = WhyNotSolid(object); !why.empty()) {
    throw Error("object", why + "; grasps of it cannot be certified", "Give a closed mesh");
  }
  GraspSet set;
  GraspSampler(hand, object, distance, options, progress, set).Run();
  return set;
}

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

// UCS-4, zero-padded to the longest.
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

// Values of one grasp: columns of the table, arrays of the archive.
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
  arrays["contact_point_object"] = ArrayOf('f', {count, 3}, points);
  arrays["contact_normal_object"] = ArrayOf('f', {count, 3}, normals);
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
  arrays["mass_center"] =
      ArrayOf('f', {3}, std::vector<double>(set.mass_center.begin(), set.mass_center.end()));
  arrays["wrist_from_object"] = ArrayOf('f', {count, 4, 4}, wrist);
  arrays["object_from_wrist"] = ArrayOf('f', {count, 4, 4}, object_pose);
  arrays["finger_pose"] = ArrayOf('f', {count, 45}, fingers);
  arrays["style"] = Texts({count}, styles);
  arrays["fingers_touching"] = ArrayOf('b', {count, kNumFingers}, touching);
  arrays["palm_touching"] = ArrayOf('b', {count}, palm);
  arrays["friction"] = ArrayOf('f', {count}, friction);
  arrays["ball_length"] = ArrayOf('f', {count}, length);
  for (const Quality& quality : kQualities) {
    std::vector<double> values;
    for (const CertifiedGrasp& grasp : set.grasps) values.push_back(quality.value(grasp));
    arrays[quality.name] = ArrayOf('f', {count}, values);
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
