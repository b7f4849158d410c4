// SPDX-License-Identifier: MIT
#include "geometry/inspect/clip_findings.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "geometry/conventions/hand_evidence.h"
#include "geometry/conventions/posture.h"
#include "geometry/import/load_clip.h"
#include "geometry/inspect/inspection.h"

namespace holdfast {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;
constexpr std::size_t kShownLeaps = 3;

// Command that imports a clip with an option that repairs it.
std::string ImportCommand(const Inspection& inspection, const std::string& option,
                          const std::string& suffix) {
  return fmt::format("holdfast import {} {} -o {}", ShellWord(inspection.path), option,
                     ShellWord(Stem(inspection.path) + suffix + ".npz"));
}

void DescribePosture(const LooseMotion& motion, const Posture& posture, Inspection& inspection) {
  const bool file_is_clip = inspection.identity.kind == FileKind::kClip;
  if (!motion.has_root || !motion.has_body) return;
  inspection.AddFact("up_axis", posture.up_is_certain ? AxisName(posture) : "undecided", "");
  inspection.AddFact("head_over_feet_m", posture.head_over_feet, "");
  if (!posture.up_is_certain) {
    inspection.Warn("the up axis is ambiguous: the body does not stand upright for long",
                    "make sure that z is up");
  } else if (AxisName(posture) == "z") {
    inspection.Ok(fmt::format("z is up: the head is {:.2f} m above the feet, in {:.0f} % of frames",
                              posture.head_over_feet, 100 * posture.share));
  } else {
    inspection.Fault(
        fmt::format(
            "{} is up (the head is {:.2f} m over the feet along it, in {:.0f} % of frames); "
            "Holdfast's world is z-up",
            AxisName(posture), posture.head_over_feet, 100 * posture.share),
        "rotate root_orient and trans to z-up");
    if (file_is_clip) {
      inspection.next.push_back(
          ImportCommand(inspection, fmt::format("--up={}", AxisName(posture)), "_zup"));
    }
  }
  if (!motion.has_trans) return;
  inspection.AddFact("meters_per_unit", posture.meters_per_unit, "");
  inspection.AddFact("ground_height_m", posture.ground_m, "");
  inspection.AddFact("root_height_m", posture.root_height_m, "");
  inspection.AddFact("fastest_root_m_per_s", posture.fastest_root_m_per_s, "");
  const std::string unit = posture.meters_per_unit == 1.0    ? "meters"
                           : posture.meters_per_unit == 0.01 ? "centimeters"
                                                             : "millimeters";
  if (posture.meters_per_unit != 1.0) {
    inspection.Fault(
        fmt::format("trans is in {}: in meters, the feet would not be on the ground", unit),
        fmt::format("multiply trans by {:g}", posture.meters_per_unit));
    if (file_is_clip) {
      inspection.next.push_back(ImportCommand(
          inspection, fmt::format("--meters-per-unit {:g}", posture.meters_per_unit), "_m"));
    }
  } else if (posture.unit_is_certain) {
    inspection.Ok("trans is in meters");
  }
  const std::string ground = fmt::format(
      "ground at {:+.3f} m, a foot on it in {:.0f} % of frames, pelvis {:.2f} m over it",
      posture.ground_m, 100 * posture.grounded_share, posture.root_height_m);
  if (std::abs(posture.ground_m) < 0.05) {
    inspection.Ok(ground);
  } else {
    inspection.Warn(
        ground + (std::abs(posture.ground_m) < 0.12 ? " (with a body of average shape)" : ""),
        fmt::format("subtract {:.3f} m from the heights in trans to put the ground at 0",
                    posture.ground_m));
  }
  if (posture.fastest_root_m_per_s > 13.0) {
    inspection.Warn(fmt::format("the root moves at up to {:.0f} m/s, faster than a sprinter",
                                posture.fastest_root_m_per_s),
                    "check for discontinuities, a wrong frame rate or a wrong unit");
  }
}

void DescribeMotion(const LooseMotion& motion, double meters_per_unit, Inspection& inspection) {
  const std::vector<Discontinuity> leaps = FindDiscontinuities(motion, meters_per_unit);
  inspection.AddFact("leaps", static_cast<double>(leaps.size()), "");
  if (!leaps.empty()) {
    std::vector<std::string> shown;
    for (std::size_t k = 0; k < std::min(leaps.size(), kShownLeaps); ++k) {
      const Discontinuity& leap = leaps[k];
      shown.push_back(
          leap.turns ? fmt::format("frame {}: {} by {:.0f} degrees", leap.frame, leap.what,
                                   kDegrees * leap.size)
                     : fmt::format("frame {}: {} by {:.2f} m", leap.frame, leap.what, leap.size));
    }
    inspection.Warn(
        fmt::format("discontinuities in {} of {} frames ({}{})", leaps.size(), motion.frames,
                    fmt::join(shown, "; "), leaps.size() > kShownLeaps ? "; ..." : ""),
        "cut the clip there, or smooth it");
  }
  const std::vector<JointLimitViolation> bends = FindOverbends(motion);
  inspection.AddFact("overbent_joints", static_cast<double>(bends.size()), "");
  if (!bends.empty()) {
    const JointLimitViolation& worst = bends.front();
    inspection.Warn(
        fmt::format(
            "{} joint{} bent beyond anatomical limits: {} in {} frames, from frame {}, up to "
            "{:.0f} degrees",
            bends.size(), bends.size() == 1 ? "" : "s", kJointNames[worst.joint], worst.frames,
            worst.first_frame, kDegrees * worst.worst_rad),
        "check the order of the joints and the units of the angles");
  }
  const double hinges = HingeAgreement(motion);
  if (hinges < 0) return;
  inspection.AddFact("hinge_agreement", hinges, "");
  if (hinges < 0.6) {
    inspection.Warn(fmt::format("knees and elbows do not turn like hinges ({:.0f} % about their "
                                "axes): the joints may be in another order",
                                100 * hinges),
                    "SMPL-X's order is pelvis, left_hip, right_hip, spine1, left_knee, ...");
  } else {
    inspection.Ok(
        fmt::format("knees and elbows turn like hinges ({:.0f} %): the joints are in "
                    "SMPL's order",
                    100 * hinges));
  }
}

}  // namespace

void DescribeHands(const LooseMotion& motion, const BodyModel& body, Inspection& inspection) {
  using Reading = HandMeanEvidence::Reading;
  const HandMeanEvidence evidence = JudgeHandMean(motion, body);
  if (!motion.has_hands) {
    inspection.Warn("no finger poses: the hands are straight",
                    "'holdfast fit' closes the holding hand");
    return;
  }
  const char* names[] = {"full", "relative", "undecided", "zero", "absent"};
  inspection.AddFact("hand_pose", names[static_cast<int>(evidence.reading)], "");
  inspection.AddFact("hand_from_mean", evidence.from_mean, "");
  inspection.AddFact("hand_from_zero", evidence.from_zero, "");
  const std::string seen = fmt::format(
      "their closest distance is {:.2f} to a relaxed hand and {:.2f} to a flat hand (1 is the "
      "distance between the two)",
      evidence.from_mean, evidence.from_zero);
  switch (evidence.reading) {
    case Reading::kFull:
      inspection.Ok(fmt::format("finger poses are {}full rotations (flat_hand_mean=True): {}",
                                evidence.certain ? "" : "probably ", seen));
      break;
    case Reading::kRelative:
      inspection.Warn(
          fmt::format(
              "finger poses are {}differences from the mean hand (flat_hand_mean=False): {}",
              evidence.certain ? "" : "probably ", seen),
          "add the model's hands_meanl and hands_meanr to pose_hand: Holdfast expects full "
          "rotations");
      break;
    case Reading::kZero:
      inspection.Warn("finger poses are all zero: not captured, so the hands are flat",
                      "'holdfast fit' closes the holding hand");
      break;
    case Reading::kUndecided:
      inspection.Warn(
          fmt::format("it is unclear whether finger poses include the mean hand: {}", seen),
          "check: holdfast render " + ShellWord(inspection.path) + " -o hand.png --camera hand");
      break;
    case Reading::kAbsent:
      break;
  }
  if (evidence.reading != Reading::kZero && evidence.reading != Reading::kAbsent) {
    inspection.AddFact("fingers_move", evidence.moves ? "yes" : "no",
                       evidence.moves ? "" : "the fingers keep one pose throughout");
  }
}

void DescribeObject(const LooseMotion& motion, const BodyModel& body, double meters_per_unit,
                    Inspection& inspection) {
  if (!motion.has_object || !motion.has_body) return;
  const ObjectEvidence evidence = JudgeObject(motion, body, meters_per_unit);
  using Convention = ObjectEvidence::Convention;
  const std::string seen = fmt::format(
      "relative to the wrist, it rotates {:.1f} degrees in 0.2 s if columns, {:.1f} if rows",
      kDegrees * evidence.column_drift_rad, kDegrees * evidence.row_drift_rad);
  inspection.AddFact("object_rotation",
                     evidence.convention == Convention::kColumn ? "column"
                     : evidence.convention == Convention::kRow  ? "row"
                                                                : "undecided",
                     "");
  if (evidence.steps > 0) {
    inspection.AddFact("object_column_drift_deg", kDegrees * evidence.column_drift_rad, "");
    inspection.AddFact("object_row_drift_deg", kDegrees * evidence.row_drift_rad, "");
  }
  switch (evidence.convention) {
    case Convention::kColumn:
      inspection.Ok(fmt::format("the object's rotation acts on column vectors, R x + T: {}", seen));
      break;
    case Convention::kRow:
      inspection.Fault(
          fmt::format("the object's rotation acts on row vectors, x R + T, as in GRAB: {}", seen),
          "transpose it: negate object_orient");
      if (inspection.identity.kind == FileKind::kClip) {
        inspection.next.push_back(fmt::format(
            "python3 -c 'import sys, numpy as np; d = dict(np.load(sys.argv[1])); "
            "d[\"object_orient\"] = -d[\"object_orient\"]; np.savez(sys.argv[2], **d)' {} {}",
            ShellWord(inspection.path), ShellWord(Stem(inspection.path) + "_columns.npz")));
      }
      break;
    case Convention::kUndecided:
      inspection.Ok(
          evidence.steps == 0
              ? "it is unclear whether the object's rotation acts on row or column vectors: the "
                "object never rotates while it is carried"
              : fmt::format(
                    "it is unclear whether the object's rotation acts on row or column vectors: {}",
                    seen));
      break;
  }
  std::string holder = "no hand";
  if (evidence.holder) {
    holder = fmt::format("the {} hand", SideName(*evidence.holder));
    inspection.AddFact("holding_hand", std::string(SideName(*evidence.holder)), "");
  } else {
    inspection.AddFact("holding_hand", "none", "");
  }
  inspection.AddFact(
      "wrist_distance_m", evidence.wrist_distance_m,
      !evidence.moves
          ? fmt::format("the object does not move; median {:.2f} m from the nearer wrist",
                        evidence.wrist_distance_m)
          : fmt::format("carried by {}{}; median {:.2f} m from {} wrist", holder,
                        evidence.holder
                            ? fmt::format(" in {:.0f} % of its moves", 100 * evidence.holder_share)
                            : std::string(),
                        evidence.wrist_distance_m, evidence.holder ? "its" : "the nearer"));
  if (evidence.holder && !motion.holding_hand.empty()) {
    const auto says = [&](int bits) { return (bits & HoldingBit(*evidence.holder)) != 0; };
    if (std::ranges::none_of(motion.holding_hand, says)) {
      inspection.Warn(fmt::format("holding_hand is never {}, although that hand carries the object",
                                  SideName(*evidence.holder)),
                      "check holding_hand: 1 is right, 2 left, 3 both");
    }
  }
}

double DescribeBodyMotion(const LooseMotion& motion, const BodyModel& body,
                          Inspection& inspection) {
  if (motion.IsHandAlone()) return 1.0;
  const Posture posture = MeasurePosture(motion, body);
  DescribePosture(motion, posture, inspection);
  DescribeMotion(motion, posture.meters_per_unit, inspection);
  return posture.meters_per_unit;
}

void ProposeForHandAlone(const Clip& clip, const std::string& word, const std::string& stem,
                         Inspection& inspection) {
  const auto moves = [&](Side side) {
    return std::ranges::any_of(clip.pose, [&](const JointPose& pose) {
      return !pose.middleCols<kJointsPerHand>(HandBegin(side)).isZero(0.0);
    });
  };
  const bool left = moves(Side::kLeft) && !moves(Side::kRight);
  const std::string model = left ? "MANO_LEFT" : "MANO_RIGHT";
  inspection.AddFact(
      "needs_model", model,
      fmt::format("a {} hand alone: other commands need its own model, --body {}.pkl",
                  left ? "left" : "right", model));
  for (const char* extension : {".pkl", ".npz"}) {
    const std::filesystem::path beside =
        inspection.path.parent_path() / std::string(model + extension);
    std::error_code ignored;
    if (!std::filesystem::is_regular_file(beside, ignored)) continue;
    const std::string body = ShellWord(beside);
    if (clip.object) {
      inspection.next.push_back(
          fmt::format("holdfast report {} --body {} -o {}.html", word, body, stem));
    } else {
      inspection.next.push_back(
          fmt::format("holdfast fit {} mug --body {} -o {}_held", word, body, stem));
    }
    return;
  }
}

void DescribeOnBody(const Clip& clip, const std::optional<TriangleMesh>& mesh,
                    const std::shared_ptr<const BodyModel>& body, Inspection& inspection) {
  const auto [change, held] = NotesOnBody(clip, body, mesh ? &*mesh : nullptr);
  if (!change.empty()) inspection.Ok(change);
  if (held) inspection.Warn(*held, std::string(kHeldRemedy));
}

}  // namespace holdfast
