// SPDX-License-Identifier: MIT
#include "solver/grasp/grasp_assessment.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "solver/grasp/grasp_handle_placement.h"
#include "solver/grasp/grasp_placement.h"

namespace holdfast {
namespace {

constexpr int kSurfacePoints = 8000;

// A flat object may be turned over; a tall one has an up.
double Tallness(const Eigen::Vector3d& extent) {
  const double wide = std::max(extent.x(), extent.y());
  return wide > 0.0 ? std::clamp(1.5 * extent.z() / wide, 0.4, 1.0) : 1.0;
}

// Deviation from a relaxed posture and between neighboring fingers, mean squared radians.
double Discomfort(const HandAxes& axes, const HandAngles& angles) {
  const HandAngles apart = angles - axes.Relaxed();
  double sum = apart.squaredNorm() / kJointsPerHand;
  constexpr int kOrder[4] = {3 * kIndex, 3 * kMiddle, 3 * kRing, 3 * kPinky};
  for (int n = 0; n < 3; ++n) {
    for (int j = 0; j < 2; ++j) {
      sum += std::pow(angles(0, kOrder[n] + j) - angles(0, kOrder[n + 1] + j), 2);
    }
  }
  return sum;
}

// Penalty for reaching below the object, by its height: with a flat object this cannot be avoided.
double BelowTable(const GraspScene& scene, const Grasp& grasp) {
  constexpr double kTall = 0.07, kFarBelow = 25.0;
  const std::vector<Eigen::Vector3d>& press = scene.use.press;
  const bool from_below =
      !press.empty() && std::all_of(press.begin(), press.end(), [](const Eigen::Vector3d& way) {
        return std::abs(way.z()) > 0.8;
      });
  if (from_below || scene.use.up.z() < 0.8) return 0.0;
  return scene.options.table_weight * std::min(1.0, scene.height / kTall) *
         std::min(1.0, grasp.below_bottom_mm / kFarBelow);
}

// Fraction of the skin in contact that is outside the requested region.
double OutsidePlace(const GraspPlace& place, const Eigen::Matrix3Xd& skin,
                    const Eigen::VectorXd& distance) {
  const double near = 1e-3 * ContactProtocol{}.contact_threshold_mm;
  int touching = 0, outside = 0;
  for (Eigen::Index s = 0; s < skin.cols(); ++s) {
    if (distance(s) >= near) continue;
    ++touching;
    outside += !place.InRegion(skin.col(s));
  }
  return touching == 0 ? 0.0 : outside / static_cast<double>(touching);
}

// Number of fingers with their backs against the object.
int KnucklesTouching(const GraspScene& scene, HandEvaluation& hand, const FingerPose& fingers,
                     const Eigen::VectorXd& distance) {
  const HandAnatomy& anatomy = scene.anatomy;
  const HandState& state = hand.At(fingers);
  std::array<bool, kNumFingers> touching{};
  Eigen::Matrix3Xd centers;
  BallCenters(anatomy.landmarks, state.Vertices(), centers);
  for (std::size_t b = 0; b < anatomy.landmarks.Balls().size(); ++b) {
    const FingerBall& ball = anatomy.landmarks.Balls()[b];
    const Eigen::Vector3d pad =
        state.JointRotation(ball.finger_joint) * anatomy.axes.PadDirection(ball.finger_joint);
    for (const int i : ball.ring) {
      const Eigen::Vector3d out = state.Vertices().col(i) - centers.col(b);
      if (distance(i) < scene.options.touch_distance_m && out.dot(pad) < -0.5 * out.norm()) {
        touching[ball.finger_joint / 3] = true;
      }
    }
  }
  return static_cast<int>(std::count(touching.begin(), touching.end(), true));
}

// Contacts of the hand with the object, in the object frame.
struct HandContacts {
  std::vector<GraspContact> points;
  int parts = 0;                                        // number of touching parts
  std::array<bool, kNumHandParts> touching{};           // per part
  std::array<Eigen::Vector3d, kNumHandParts> pressing;  // direction each touching part presses in
};

// Touching skin points of a part's pad, nearest first.
std::vector<std::pair<double, int>> TouchingOfPad(const GraspScene& scene, int part,
                                                  const Eigen::VectorXd& distance) {
  std::vector<std::pair<double, int>> near;
  for (const int i : scene.anatomy.landmarks.Pad(part)) {
    if (distance(i) < scene.options.touch_distance_m) near.emplace_back(distance(i), i);
  }
  std::sort(near.begin(), near.end());
  return near;
}

// Also sets in `grasp` which fingers touch and whether the palm does.
HandContacts FindHandContacts(const GraspScene& scene, const Eigen::Matrix3Xd& skin,
                              const Eigen::VectorXd& distance, Grasp& grasp) {
  HandContacts contacts;
  const auto add_contact = [&](int vertex) {
    Eigen::Vector3d outward;
    scene.object.Distance(skin.col(vertex), &outward);
    if (outward.norm() > 1e-6) contacts.points.push_back({skin.col(vertex), -outward.normalized()});
  };
  for (int part = 0; part < kNumHandParts; ++part) {
    const std::vector<std::pair<double, int>> near = TouchingOfPad(scene, part, distance);
    if (near.empty()) continue;
    ++contacts.parts;
    if (part == kPalmPart) {
      grasp.palm_touching = true;
    } else {
      grasp.fingers_touching[part / 3] = true;
    }
    add_contact(near.front().second);
    contacts.touching[part] = !contacts.points.empty();
    if (contacts.touching[part]) contacts.pressing[part] = contacts.points.back().inward;
    // A palm counts as several pads: add touching places that are far apart.
    if (part == kPalmPart) {
      for (const auto& [d, i] : near) {
        if ((skin.col(i) - skin.col(near.front().second)).norm() > 0.025) {
          add_contact(i);
          break;
        }
      }
    }
  }
  return contacts;
}

// Rewards fingers that press against the thumb or the palm; the others only touch.
double Opposed(const HandContacts& contacts) {
  double opposed = 0.0;
  for (int finger = 0; finger < kThumb; ++finger) {
    double most = 0.0;
    for (int part = 3 * finger; part < 3 * finger + 3; ++part) {
      if (!contacts.touching[part]) continue;
      for (const int other : {3 * kThumb + 1, 3 * kThumb + 2, kPalmPart}) {
        if (contacts.touching[other]) {
          most = std::max(most, -contacts.pressing[part].dot(contacts.pressing[other]));
        }
      }
    }
    opposed += 0.25 * most;
  }
  return opposed;
}

// How directly the thumb's last phalanx presses against the fingers: the mean over those that
// touch.
double ThumbOpposition(const HandContacts& contacts) {
  constexpr int kTip = 3 * kThumb + 2;
  if (!contacts.touching[kTip]) return 0.0;
  double sum = 0.0;
  int fingers = 0;
  for (int finger = 0; finger < kThumb; ++finger) {
    double most = -1.0;
    for (int part = 3 * finger; part < 3 * finger + 3; ++part) {
      if (!contacts.touching[part]) continue;
      most = std::max(most, -contacts.pressing[part].dot(contacts.pressing[kTip]));
    }
    if (most == -1.0) continue;
    sum += most;
    ++fingers;
  }
  return fingers == 0 ? 0.0 : sum / fingers;
}

// Deviation of the thumb from how it wraps around held objects: the flexion of its last two joints
// together is mostly between 25 and 75 degrees. 1 for a straight thumb and for 110 degrees.
double ThumbUnease(const HandAngles& angles) {
  constexpr double kLow = 25.0, kHigh = 75.0, kTooHigh = 110.0;
  const double flexion =
      (angles(0, 3 * kThumb + 1) + angles(0, 3 * kThumb + 2)) * 180.0 / std::numbers::pi;
  return std::clamp(std::max(1.0 - flexion / kLow, (flexion - kHigh) / (kTooHigh - kHigh)), 0.0,
                    1.5);
}

// Forces that do not cancel push the object away instead of holding it.
double Leaning(const std::vector<GraspContact>& contacts) {
  Eigen::Vector3d resultant = Eigen::Vector3d::Zero();
  for (const GraspContact& contact : contacts) resultant += contact.inward;
  return contacts.empty() ? 1.0 : resultant.norm() / static_cast<double>(contacts.size());
}

// Mean of the contacts, or of the whole skin if there are none.
Eigen::Vector3d MiddleOfHold(const std::vector<GraspContact>& contacts,
                             const Eigen::Matrix3Xd& skin) {
  if (contacts.empty()) return skin.rowwise().mean();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const GraspContact& contact : contacts) sum += contact.point;
  return sum / static_cast<double>(contacts.size());
}

bool AtPoint(const GraspScene& scene) { return scene.options.place && scene.options.place->At(); }

// Weighted sum of the measures, without the terms for handles. `off_center`: lever of the object's
// weight, or distance to the requested place, meters.
double Score(const GraspScene& scene, const Grasp& grasp, const HandAngles& angles,
             const HandContacts& contacts, double off_center) {
  const double opposed = Opposed(contacts);
  const double leaning = Leaning(contacts.points);
  const auto fingers = static_cast<double>(
      std::count(grasp.fingers_touching.begin(), grasp.fingers_touching.end(), true));
  const bool in_palm = grasp.palm_touching && grasp.style != GraspStyle::kPrecision;
  // A tool rotates about its own axis if only a few parts press it.
  const double part_worth = scene.use.kind == GraspUse::kTool ? 0.06 : 0.02;
  // Only what is held flat: a thumb also lies along a bar, and closes over the fingers around it
  // (Feix et al.: adducted thumb, medium wrap). An apple is then held worse.
  const bool flat = scene.use.kind == GraspUse::kCamera || scene.use.kind == GraspUse::kPhone;
  const double thumb =
      flat ? 0.3 * std::max(0.0, grasp.thumb_opposition) - 0.25 * ThumbUnease(angles) : 0.0;
  return 1.4 * std::sqrt(std::min(grasp.wrench_quality / 0.3, 1.0)) + 0.1 * fingers + thumb +
         0.5 * opposed + part_worth * contacts.parts + (in_palm ? scene.use.palm_worth : 0.0) +
         (grasp.fingers_touching[kThumb] ? 0.4 : 0.0) -
         0.2 * std::max(0.0, grasp.max_penetration_mm - 0.7) -
         0.15 * std::max(0.0, grasp.object_in_hand_mm - 1.5) - 0.15 * grasp.self_penetration_mm -
         0.6 * Discomfort(scene.anatomy.axes, angles) -
         (AtPoint(scene) ? 20.0 : 6.0) * std::max(0.0, off_center - 0.015) -
         3.0 * grasp.outside_place - 0.8 * std::max(0.0, leaning - 0.2) +
         UprightScore(scene, grasp.style, grasp.upright) - BelowTable(scene, grasp) -
         scene.options.obstacle_weight * grasp.blocked;
}

}  // namespace

ClosedHands::ClosedHands(const HandModel& hand)
    : fill_({hand.Surface().RestVertices(), hand.Surface().Faces()}) {}

std::vector<ClosedHands::Inside> ClosedHands::FindInside(const Eigen::Matrix3Xd& vertices,
                                                         const Eigen::Matrix3Xd& points,
                                                         const PointPatches& patches) const {
  const TriangleMesh closed{fill_.Vertices(vertices), fill_.Faces()};
  std::unique_ptr<SignedDistance> hand;
  {
    const std::lock_guard lock(mutex_);
    if (!idle_.empty()) {
      hand = std::move(idle_.back());
      idle_.pop_back();
    }
  }
  if (hand) {
    hand->Move(closed.vertices);
  } else {
    hand = std::make_unique<SignedDistance>(closed);
  }
  const Eigen::AlignedBox3d box(hand->Min(), hand->Max());
  std::vector<Inside> inside;
  int face = -1;
  patches.Least(
      [&](int i) {
        const Eigen::Vector3d x = points.col(i);
        if (!box.contains(x)) return box.exteriorDistance(x);
        const SignedDistance::Result nearest = hand->Query(x, face);
        face = nearest.face;
        if (nearest.distance >= 0.0) return nearest.distance;
        Eigen::Matrix3d corners;
        for (int k = 0; k < 3; ++k) corners.col(k) = closed.vertices.col(closed.faces(k, face));
        const Eigen::Matrix<double, 3, 2> edges = corners.rightCols<2>().colwise() - corners.col(0);
        const Eigen::Vector2d shares =
            (edges.transpose() * edges)
                .ldlt()
                .solve(edges.transpose() * (nearest.closest - corners.col(0)));
        inside.push_back({-nearest.distance,
                          {x,
                           {closed.faces(0, face), closed.faces(1, face), closed.faces(2, face)},
                           {1.0 - shares.sum(), shares.x(), shares.y()},
                           (nearest.closest - x).normalized()}});
        return 0.0;  // lowest possible bound: no inside point is pruned
      },
      0.0);
  const std::lock_guard lock(mutex_);
  idle_.push_back(std::move(hand));
  return inside;
}

GraspScene::GraspScene(const HandAnatomy& hand, const GraspPlacer& hand_placer,
                       const DistanceGrid& distance, const TriangleMesh& mesh,
                       const GraspOptions& search_options)
    : anatomy(hand),
      placer(hand_placer),
      object(distance),
      centroid(SolidCentroid(mesh)),
      held_at(search_options.place ? search_options.place->Center() : centroid),
      size(Extent(mesh).norm()),
      bottom(mesh.vertices.row(2).minCoeff()),
      height(Extent(mesh).z()),
      tallness(Tallness(Extent(mesh))),
      surface(SampleSurface(mesh, kSurfacePoints, search_options.seed)),
      surface_patches(surface),
      hands(hand.hand),
      options(search_options),
      obstacles(options.obstacles_in_wrist) {}

void GraspScene::TakeFor(ObjectUse found) {
  use = std::move(found);
  if (options.place && options.place->IsRequired()) {
    use.hold.reset();
    use.keep_free.clear();
    use.press.clear();
    use.held_anywhere = false;
  } else if (use.held_at) {
    held_at = *use.held_at;
  }
  if (!options.place) return;
  for (const GraspPlace::Ball& ball : options.place->Avoided()) {
    use.keep_free.push_back(
        {ball.center, Eigen::Vector3d::UnitZ(), -ball.radius, ball.radius, 0.0, ball.radius});
  }
}

double Uprightness(const GraspScene& scene, const Eigen::Isometry3d& wrist_from_object) {
  if (scene.use.up_over_clip && scene.options.mean_up_in_wrist) {
    return scene.options.mean_up_in_wrist->dot(wrist_from_object.linear() * scene.use.up);
  }
  double most = scene.options.up_in_wrist.empty() ? 0.0 : -1.0;
  for (const Eigen::Vector3d& up : scene.options.up_in_wrist) {
    most = std::max(most, up.dot(wrist_from_object.linear() * scene.use.up));
  }
  return most;
}

double UprightScore(const GraspScene& scene, GraspStyle style, double upright) {
  const double weight = scene.options.upright_weight;
  if (scene.options.up_in_wrist.empty()) return 0.0;
  if (scene.use.up_weight == 0.0) {
    return weight * (style == GraspStyle::kHandle ? 3.0 : scene.tallness) * upright;
  }
  // Made to be filled: a tilt of a few degrees matters.
  const double tilt = std::sqrt(std::max(0.0, 1.0 - upright * upright));
  return weight * scene.use.up_weight * (upright - 0.8 * tilt);
}

double Blocked(const GraspScene& scene, const Eigen::Isometry3d& wrist_from_object) {
  return scene.obstacles.ShareBlocked(scene.object, wrist_from_object);
}

Grasp Assess(const GraspScene& scene, HandEvaluation& hand, const GraspAttempt& attempt,
             bool thorough) {
  const HandLandmarks& landmarks = scene.anatomy.landmarks;
  const GraspOptions& options = scene.options;
  Grasp grasp;
  grasp.style = attempt.style;
  grasp.fingers = scene.anatomy.axes.PoseOf(attempt.angles);
  grasp.wrist_from_object = attempt.wrist_from_object;
  const Eigen::Isometry3d object_from_wrist = attempt.wrist_from_object.inverse();
  const Eigen::Matrix3Xd vertices = hand.At(grasp.fingers).Vertices();
  Eigen::Matrix3Xd skin;
  SkinPositions(landmarks, vertices, skin);
  skin = object_from_wrist * skin;
  const double near =
      std::max(options.touch_distance_m, 1e-3 * ContactProtocol{}.contact_threshold_mm);
  const Eigen::VectorXd distance =
      SkinDistances(landmarks, scene.object, Eigen::Isometry3d::Identity(), skin, near);
  grasp.max_penetration_mm = 1000.0 * std::max(0.0, -distance.minCoeff());

  const HandContacts contacts = FindHandContacts(scene, skin, distance, grasp);
  grasp.thumb_opposition = ThumbOpposition(contacts);
  grasp.wrench_quality =
      WrenchQuality(contacts.points, scene.centroid, 0.5 * scene.size, options.friction);
  grasp.self_penetration_mm = 1000.0 * SelfPenetration(landmarks, vertices);
  grasp.limit_excess_deg =
      scene.anatomy.axes.LimitExcess(attempt.angles) * 180.0 / std::numbers::pi;
  grasp.below_bottom_mm = 1000.0 * std::max(0.0, scene.bottom - skin.row(2).minCoeff());
  grasp.object_up = scene.use.up;
  grasp.upright = Uprightness(scene, attempt.wrist_from_object);
  grasp.blocked = Blocked(scene, attempt.wrist_from_object);
  grasp.in_keep_free = scene.use.InKeepFree(skin);
  if (grasp.style == GraspStyle::kHandle) {
    grasp.fingers_through =
        FingersThrough(scene.anatomy.axes, hand.At(grasp.fingers), scene.handles[attempt.handle],
                       attempt.wrist_from_object);
  }
  if (thorough) {
    for (const auto& in : scene.hands.FindInside(
             vertices, attempt.wrist_from_object * scene.surface, scene.surface_patches)) {
      grasp.object_in_hand_mm = std::max(grasp.object_in_hand_mm, 1000.0 * in.depth);
    }
  }

  // Lever of the weight or distance to the requested place, meters; 0 for a handle, which is fixed.
  const bool by_handle = grasp.style == GraspStyle::kHandle;
  const bool at_point = AtPoint(scene);
  const double off_center = (by_handle || scene.use.held_anywhere) && !at_point
                                ? 0.0
                                : (MiddleOfHold(contacts.points, skin) - scene.held_at).norm();
  if (at_point) grasp.from_place_m = off_center;
  if (options.place) grasp.outside_place = OutsidePlace(*options.place, skin, distance);
  grasp.score = Score(scene, grasp, attempt.angles, contacts, off_center);
  const Eigen::Matrix3d turned = object_from_wrist.linear();
  grasp.score += scene.use.DirectionScore(turned * scene.anatomy.axes.Across(),
                                          turned * scene.anatomy.axes.Forward(),
                                          turned * scene.anatomy.axes.PalmNormal()) +
                 scene.use.PlaceScore(contacts.points, skin);
  if (by_handle) {
    const auto through = static_cast<double>(
        std::count(grasp.fingers_through.begin(), grasp.fingers_through.end(), true));
    grasp.score += options.handle_weight + 0.35 * through -
                   0.1 * KnucklesTouching(scene, hand, grasp.fingers, distance);
  }
  return grasp;
}

std::string WhyThrough(const GraspScene& scene, const Grasp& grasp) {
  if (grasp.max_penetration_mm > 1000.0 * scene.options.max_penetration_m) {
    return "the hand penetrates the object";
  }
  if (grasp.object_in_hand_mm > 1500.0 * scene.options.max_penetration_m) {
    return "the object penetrates the hand";
  }
  return {};
}

std::string WhyRefused(const GraspScene& scene, const Grasp& grasp) {
  const auto fingers =
      std::count(grasp.fingers_touching.begin(), grasp.fingers_touching.begin() + kThumb, true);
  if (std::string through = WhyThrough(scene, grasp); !through.empty()) return through;
  if (grasp.self_penetration_mm > 4.0) return "fingers penetrate each other";
  if (grasp.limit_excess_deg > 1.0) return "a joint is beyond its range";
  if (!grasp.fingers_touching[kThumb]) return "the thumb does not touch the object";
  const bool by_handle = grasp.style == GraspStyle::kHandle;
  if (by_handle &&
      std::count(grasp.fingers_through.begin(), grasp.fingers_through.end(), true) == 0) {
    return "no finger is through the handle";
  }
  if (fingers < 2 && !(fingers == 1 && (by_handle || scene.size < 0.03)))
    return "fewer than two fingers touch the object";
  if (grasp.outside_place > GraspPlace::kMaxOutside) {
    return "it touches the object outside the allowed region";
  }
  if (grasp.from_place_m > GraspPlace::kReach_m) return "it is not at the requested point";
  if (grasp.wrench_quality <= 0.0) return "the contacts do not hold the object (no force closure)";
  if (!scene.placer.ForearmClear(scene.object, grasp.wrist_from_object)) {
    return "the forearm collides with the object";
  }
  return {};
}

}  // namespace holdfast
