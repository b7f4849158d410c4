// SPDX-License-Identifier: MIT
#include "solver/grasp.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <mutex>
#include <numbers>
#include <thread>
#include <utility>

#include "solver/grasp_quality.h"
#include "solver/grasp_refinement.h"

namespace holdfast {
namespace {

using Clock = std::chrono::steady_clock;

double MillisecondsSince(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

// Runs work(i) for i in [0, count) on up to `threads` threads; every i writes its own slot only, so
// that the order does not matter. Stops when `keep_going` says so.
template <typename Work, typename KeepGoing>
void ForEach(int count, int threads, const Work& work, const KeepGoing& keep_going) {
  std::atomic<int> next{0};
  std::atomic<bool> stop{false};
  const auto run = [&] {
    for (int i = next++; i < count && !stop; i = next++) {
      work(i);
      if (!keep_going(i)) stop = true;
    }
  };
  std::vector<std::jthread> helpers;
  for (int t = 1; t < std::min(threads, count); ++t) helpers.emplace_back(run);
  run();
}

struct Scene {
  const HandAnatomy& anatomy;
  const GraspPlacer& placer;
  const DistanceGrid& object;
  Eigen::Vector3d centroid;
  double size;                 // diagonal of the bounding box
  double bottom, height;       // least z, extent in z
  double tallness;             // in (0, 1]: how much it matters which way up the object is
  Eigen::Matrix3Xd surface;    // points all over the object
  const GraspOptions& options;
};

struct Attempt {
  GraspStyle style = GraspStyle::kPower;
  HandAngles angles = HandAngles::Zero();
  Eigen::Isometry3d wrist_from_object = Eigen::Isometry3d::Identity();
  double rank = -std::numeric_limits<double>::infinity();  // before refinement
};

// What lies flat may be turned over; what stands has an up.
double Tallness(const Eigen::Vector3d& extent) {
  const double wide = std::max(extent.x(), extent.y());
  return wide > 0.0 ? std::clamp(1.5 * extent.z() / wide, 0.4, 1.0) : 1.0;
}

// How far a pose is from one that is held without thinking, mean squared radians.
double Discomfort(const HandAxes& axes, const HandAngles& angles) {
  const HandAngles apart = angles - axes.Relaxed();
  double sum = apart.squaredNorm() / kJointsPerHand;
  constexpr int kOrder[4] = {3 * kIndex, 3 * kMiddle, 3 * kRing, 3 * kPinky};
  for (int n = 0; n < 3; ++n) {
    for (int j = 0; j < 2; ++j) {
      sum += 0.5 * std::pow(angles(0, kOrder[n] + j) - angles(0, kOrder[n + 1] + j), 2);
    }
  }
  return sum;
}

double Upright(const Scene& scene, const Eigen::Isometry3d& wrist_from_object) {
  double most = scene.options.up_in_wrist.empty() ? 0.0 : -1.0;
  for (const Eigen::Vector3d& up : scene.options.up_in_wrist) {
    most = std::max(most, up.dot(wrist_from_object.linear().col(2)));
  }
  return most;
}

// What a flat object lies on cannot be avoided; below a tall one no hand has any business.
double BelowTable(const Scene& scene, const Grasp& grasp) {
  constexpr double kTall = 0.07, kFarBelow = 25.0;
  return scene.options.table_weight * std::min(1.0, scene.height / kTall) *
         std::min(1.0, grasp.below_bottom_mm / kFarBelow);
}

// Deepest point of the object's surface in the closed hand mesh, metres.
double ObjectInHand(const Scene& scene, const Eigen::Matrix3Xd& vertices,
                    const Eigen::Isometry3d& wrist_from_object) {
  const SignedDistance hand(
      CloseHoles({vertices, scene.anatomy.hand.Surface().Faces()}));
  const Eigen::AlignedBox3d box(hand.Min(), hand.Max());
  double deepest = 0.0;
  for (Eigen::Index i = 0; i < scene.surface.cols(); ++i) {
    const Eigen::Vector3d x = wrist_from_object * scene.surface.col(i);
    if (box.contains(x)) deepest = std::max(deepest, -hand.Distance(x));
  }
  return deepest;
}

// Measures and scores a hand; `thorough` adds what is slow.
Grasp Assess(const Scene& scene, HandEvaluation& hand, const Attempt& attempt, bool thorough) {
  const HandLandmarks& landmarks = scene.anatomy.landmarks;
  const GraspOptions& options = scene.options;
  Grasp grasp;
  grasp.style = attempt.style;
  grasp.fingers = scene.anatomy.axes.PoseOf(attempt.angles);
  grasp.wrist_from_object = attempt.wrist_from_object;
  const Eigen::Isometry3d object_from_wrist = attempt.wrist_from_object.inverse();
  const Eigen::Matrix3Xd vertices = hand.At(grasp.fingers.data(), false).Vertices();
  Eigen::Matrix3Xd skin;
  SkinPositions(landmarks, vertices, skin);
  skin = object_from_wrist * skin;
  Eigen::VectorXd distance(skin.cols());
  for (Eigen::Index s = 0; s < skin.cols(); ++s) distance(s) = scene.object.Distance(skin.col(s));
  grasp.max_penetration_mm = 1000.0 * std::max(0.0, -distance.minCoeff());

  std::vector<GraspContact> contacts;
  const auto add_contact = [&](int vertex) {
    Eigen::Vector3d outward;
    scene.object.Distance(skin.col(vertex), &outward);
    if (outward.norm() > 1e-6) contacts.push_back({skin.col(vertex), -outward.normalized()});
  };
  int parts_touching = 0;
  std::array<Eigen::Vector3d, kNumHandParts> pressing;  // direction each touching part presses in
  std::array<bool, kNumHandParts> touching{};
  for (int part = 0; part < kNumHandParts; ++part) {
    std::vector<std::pair<double, int>> near;
    for (const int i : landmarks.Pad(part)) {
      if (distance(i) < options.touch_distance_m) near.emplace_back(distance(i), i);
    }
    if (near.empty()) continue;
    ++parts_touching;
    if (part == kPalmPart) {
      grasp.palm_touching = true;
    } else {
      grasp.fingers_touching[part / 3] = true;
    }
    std::sort(near.begin(), near.end());
    add_contact(near.front().second);
    touching[part] = !contacts.empty();
    if (touching[part]) pressing[part] = contacts.back().inward;
    // A palm is as good as several pads: add its touching places far apart.
    if (part == kPalmPart) {
      for (const auto& [d, i] : near) {
        if ((skin.col(i) - skin.col(near.front().second)).norm() > 0.025) {
          add_contact(i);
          break;
        }
      }
    }
  }
  grasp.wrench_quality =
      WrenchQuality(contacts, scene.centroid, 0.5 * scene.size, options.friction);
  grasp.self_penetration_mm = 1000.0 * SelfPenetration(landmarks, vertices);
  grasp.limit_excess_deg =
      scene.anatomy.axes.LimitExcess(attempt.angles) * 180.0 / std::numbers::pi;
  grasp.below_bottom_mm = 1000.0 * std::max(0.0, scene.bottom - skin.row(2).minCoeff());
  grasp.upright = Upright(scene, attempt.wrist_from_object);
  if (thorough) {
    grasp.object_in_hand_mm =
        1000.0 * ObjectInHand(scene, vertices, attempt.wrist_from_object);
  }

  // Fingers that press against the thumb or the palm hold; those that rest on a side only touch.
  double opposed = 0.0;
  for (int finger = 0; finger < kThumb; ++finger) {
    double most = 0.0;
    for (int part = 3 * finger; part < 3 * finger + 3; ++part) {
      if (!touching[part]) continue;
      for (const int other : {3 * kThumb + 1, 3 * kThumb + 2, kPalmPart}) {
        if (touching[other]) most = std::max(most, -pressing[part].dot(pressing[other]));
      }
    }
    opposed += 0.25 * most;
  }
  const Eigen::Vector3d middle =
      contacts.empty() ? skin.rowwise().mean().eval() : [&] {
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        for (const GraspContact& contact : contacts) sum += contact.point;
        return Eigen::Vector3d(sum / static_cast<double>(contacts.size()));
      }();
  const double off_center = (middle - scene.centroid).norm();  // metres of lever for its weight
  const auto fingers = static_cast<double>(
      std::count(grasp.fingers_touching.begin(), grasp.fingers_touching.end(), true));
  const bool in_palm = grasp.palm_touching && grasp.style == GraspStyle::kPower;
  grasp.score = std::sqrt(std::min(grasp.wrench_quality / 0.3, 1.0)) + 0.1 * fingers + 0.5 * opposed +
                0.02 * parts_touching + (in_palm ? 0.2 : 0.0) +
                (grasp.fingers_touching[kThumb] ? 0.4 : 0.0) -
                0.2 * std::max(0.0, grasp.max_penetration_mm - 0.7) -
                0.15 * std::max(0.0, grasp.object_in_hand_mm - 1.5) -
                0.15 * grasp.self_penetration_mm -
                0.6 * Discomfort(scene.anatomy.axes, attempt.angles) - 6.0 * std::max(0.0, off_center - 0.015) +
                options.upright_weight * scene.tallness * grasp.upright - BelowTable(scene, grasp);
  return grasp;
}

std::string WhyRefused(const Scene& scene, const Grasp& grasp) {
  const auto fingers = std::count(grasp.fingers_touching.begin(),
                                  grasp.fingers_touching.begin() + kThumb, true);
  if (grasp.max_penetration_mm > 1000.0 * scene.options.max_penetration_m) {
    return "the hand goes into the object";
  }
  if (grasp.object_in_hand_mm > 1500.0 * scene.options.max_penetration_m) {
    return "the object goes into the hand";
  }
  if (grasp.self_penetration_mm > 4.0) return "fingers go into each other";
  if (grasp.limit_excess_deg > 1.0) return "a joint is beyond its range";
  if (!grasp.fingers_touching[kThumb]) return "the thumb does not touch";
  if (fingers < 2 && !(fingers == 1 && scene.size < 0.03)) return "fewer than two fingers touch";
  if (grasp.wrench_quality <= 0.0) return "contacts do not hold it (no force closure)";
  if (!scene.placer.ForearmClear(scene.object, grasp.wrist_from_object)) {
    return "the forearm is in the way";
  }
  return {};
}

}  // namespace

std::string_view Describe(GraspStatus status) {
  switch (status) {
    case GraspStatus::kFound: return "found";
    case GraspStatus::kNothingToGrasp:
      return "no two opposed places are within a hand's span";
    case GraspStatus::kNoRoom: return "there is no room for a hand at any graspable place";
    case GraspStatus::kNoCleanGrasp: return "no grasp is clean and firm";
  }
  return "";
}

std::string_view StyleName(GraspStyle style) {
  return style == GraspStyle::kPower ? "power" : "precision";
}

Eigen::Isometry3d ObjectInWorld(const Grasp& grasp, const Eigen::Matrix3d& wrist_rotation,
                                const Eigen::Vector3d& wrist_position) {
  Eigen::Isometry3d world_from_wrist = Eigen::Isometry3d::Identity();
  world_from_wrist.linear() = wrist_rotation;
  world_from_wrist.translation() = wrist_position;
  return world_from_wrist * grasp.wrist_from_object;
}

Grasp CloseHand(const HandModel& hand, const TriangleMesh& object, const SignedDistance& surface,
                const DistanceGrid& distance, const GraspOptions& options, GraspReport* report,
                const GraspProgress& progress) {
  GraspReport unused;
  GraspReport& out = report ? *report : unused;
  out = {};
  const HandAnatomy anatomy(hand);
  const GraspPlacer placer(anatomy);
  const Scene scene{anatomy,
                    placer,
                    distance,
                    SolidCentroid(object),
                    Extent(object).norm(),
                    object.vertices.row(2).minCoeff(),
                    Extent(object).z(),
                    Tallness(Extent(object)),
                    SampleSurface(object, 8000, options.seed),
                    options};
  Grasp open;
  open.fingers = anatomy.axes.PoseOf(OpenHand(anatomy.axes));

  std::mutex progress_mutex;
  double work_before = 0.0, work_share = 0.0;
  int done = 0;
  bool cancelled = false;
  const auto keep_going = [&](int count) {
    return [&, count](int) {
      if (!progress) return true;
      const std::lock_guard lock(progress_mutex);
      cancelled |= !progress(work_before + work_share * ++done / count);
      return !cancelled;
    };
  };
  const auto begin_stage = [&](double before, double share) {
    work_before = before;
    work_share = share;
    done = 0;
  };

  // Where a hand could go.
  Clock::time_point stage = Clock::now();
  OppositionOptions opposition_options;
  opposition_options.count = options.oppositions;
  opposition_options.seed = options.seed;
  const std::vector<Opposition> oppositions =
      FindOppositions(object, distance, scene.centroid, opposition_options);
  out.oppositions = static_cast<int>(oppositions.size());
  if (oppositions.empty()) return open;
  double thinnest = oppositions.front().width;
  for (const Opposition& opposition : oppositions) thinnest = std::min(thinnest, opposition.width);
  const GraspPlacer::Target target{distance, scene.size, std::clamp(0.2 * thinnest, 0.0005, 0.003)};
  ClosingOptions closing_options;
  closing_options.allowed_depth = std::min(closing_options.allowed_depth, target.allowed_depth);
  std::vector<std::vector<Placement>> placed(oppositions.size());
  begin_stage(0.0, 0.2);
  ForEach(
      out.oppositions, options.threads,
      [&](int i) {
        placed[i] = placer.Place(oppositions[i], target, options.turns);
      },
      keep_going(out.oppositions));

  // The most promising, but not all from one place: each further one from the same counts less.
  std::vector<std::pair<double, Placement>> queue;
  for (std::vector<Placement>& placements : placed) {
    out.placements += static_cast<int>(placements.size());
    for (const GraspStyle style : {GraspStyle::kPower, GraspStyle::kPrecision}) {
      std::vector<std::pair<double, const Placement*>> of_style;
      for (const Placement& placement : placements) {
        if (placement.style != style) continue;
        const double upright = Upright(scene, placement.wrist_from_object);
        of_style.emplace_back(placement.prior * std::exp(options.upright_weight * scene.tallness * upright),
                              &placement);
      }
      std::stable_sort(of_style.begin(), of_style.end(),
                       [](const auto& a, const auto& b) { return a.first > b.first; });
      double discount = 1.0;
      for (const auto& [prior, placement] : of_style) {
        queue.emplace_back(prior * discount, *placement);
        discount *= 0.9;
      }
    }
  }
  std::stable_sort(queue.begin(), queue.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  if (static_cast<int>(queue.size()) > options.closings) queue.resize(options.closings);
  out.search_ms = MillisecondsSince(stage);
  if (queue.empty()) {
    out.status = GraspStatus::kNoRoom;
    return open;
  }

  stage = Clock::now();
  out.closings = static_cast<int>(queue.size());
  std::vector<Attempt> attempts(queue.size());
  begin_stage(0.2, 0.4);
  ForEach(
      out.closings, options.threads,
      [&](int i) {
        HandEvaluation evaluation = AtWrist(hand);
        const Placement& placement = queue[i].second;
        const Closing closing = CloseFingers(anatomy, evaluation, distance,
                                             placement.wrist_from_object, placement.start,
                                             closing_options);
        attempts[i] = {placement.style, closing.angles, placement.wrist_from_object};
        attempts[i].rank = Assess(scene, evaluation, attempts[i], false).score;
      },
      keep_going(out.closings));
  std::stable_sort(attempts.begin(), attempts.end(),
                   [](const Attempt& a, const Attempt& b) { return a.rank > b.rank; });
  std::erase_if(attempts, [](const Attempt& a) { return !std::isfinite(a.rank); });  // cancelled
  out.closing_ms = MillisecondsSince(stage);

  stage = Clock::now();
  out.refinements = std::min<int>(options.refinements, static_cast<int>(attempts.size()));
  std::vector<GraspReport::Candidate> refined(out.refinements);
  std::vector<char> is_refined(out.refinements, 0);
  begin_stage(0.6, 0.4);
  ForEach(
      out.refinements, options.threads,
      [&](int i) {
        HandEvaluation evaluation = AtWrist(hand);
        Attempt attempt = attempts[i];
        RefineGrasp(anatomy, evaluation, distance, {}, attempt.angles,
                    attempt.wrist_from_object);
        refined[i].grasp = Assess(scene, evaluation, attempt, true);
        refined[i].refused = WhyRefused(scene, refined[i].grasp);
        is_refined[i] = 1;
      },
      keep_going(out.refinements));
  for (int i = out.refinements - 1; i >= 0; --i) {
    if (!is_refined[i]) refined.erase(refined.begin() + i);
  }
  if (refined.empty()) {
    out.status = GraspStatus::kNoRoom;
    return open;
  }
  std::stable_sort(refined.begin(), refined.end(), [](const auto& a, const auto& b) {
    if (a.refused.empty() != b.refused.empty()) return a.refused.empty();
    return a.grasp.score > b.grasp.score;
  });
  Grasp best = refined.front().grasp;
  out.status = refined.front().refused.empty() ? GraspStatus::kFound : GraspStatus::kNoCleanGrasp;
  out.candidates = std::move(refined);

  HandEvaluation evaluation = AtWrist(hand);
  const Eigen::Matrix3Xd in_object =
      best.wrist_from_object.inverse() * evaluation.At(best.fingers.data(), false).Vertices();
  best.metrics = MeasureContact(TriangleMesh{in_object, hand.Surface().Faces()}, surface);
  out.candidates.front().grasp.metrics = best.metrics;
  out.refinement_ms = MillisecondsSince(stage);
  return best;
}

}  // namespace holdfast
