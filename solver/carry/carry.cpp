// SPDX-License-Identifier: MIT
#include "solver/carry/carry.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <functional>
#include <future>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "geometry/error.h"
#include "geometry/mesh/surface_distance.h"
#include "geometry/rotation.h"
#include "geometry/seed.h"
#include "solver/fit/clip_state.h"
#include "solver/handover/hand_passage.h"
#include "solver/handover/passage_clearance.h"
#include "solver/recipes/imos_code.h"

namespace holdfast {
namespace {

constexpr std::uint8_t kHoldsBoth = kHoldsRight | kHoldsLeft;

HoldLabels Always(std::uint8_t bits, std::size_t frames) {
  return {std::vector<std::uint8_t>(frames, bits), {}, std::vector<double>(frames, 1.0)};
}

std::uint8_t BitsOf(GraspHands hands) {
  if (hands == GraspHands::kLeft) return kHoldsLeft;
  return hands == GraspHands::kBoth ? kHoldsBoth : kHoldsRight;
}

bool IsThroughBody(const ClearanceReport& report) {
  return std::ranges::any_of(report.frames, [](const ClearanceReport::Frame& frame) {
    return frame.in_body_m > ClearanceOptions{}.max_left_m;
  });
}

// One run through all stages.
class Carrier {
 public:
  Carrier(const Clip& clip, const ClipBody& body, const PreparedObject& object,
          const CarryOptions& options, const StagedProgress& progress)
      : clip_(clip),
        body_(body),
        object_(object),
        options_(options),
        progress_(progress),
        right_(body.model, body.betas, Side::kRight),
        left_(body.model, body.betas, Side::kLeft) {
    options_.fit.threads = options_.protocol.threads = options_.threads;
    if (options_.recipe == FitRecipe::kPaper) options_.fit = options_.fit.OnlyPaper();
  }

  CarryReport Run() {
    if (options_.drink && !Serve()) return Ended(CarryStatus::kNoGrasp);
    needs_grasp_ = NeedsGrasp(clip_, object_.object, options_);
    if (options_.hand_over) RequireHands(*body_.model, kHoldsBoth);
    report_.holding = WhoHolds();
    for (const std::uint8_t bits : report_.holding.hands) report_.held_by |= bits;
    RequireHands(*body_.model, report_.held_by);
    if (needs_grasp_) {
      TakeHold();
      if (stopped_) return std::move(report_);
      if (!report_.grasp.found) return Ended(CarryStatus::kNoGrasp);
    }
    NameObject();
    StartClearanceAsync();
    Fit();
    if (stopped_) return std::move(report_);
    ResolveBodyCollisions();
    Measure();
    if (stopped_) return std::move(report_);
    const bool touched = report_.contact.contact_frames_ratio.value_or(0.0) > 0.0;
    if (touched) Warn();
    return Ended(touched ? CarryStatus::kCarried : CarryStatus::kNoContact);
  }

 private:
  CarryReport Ended(CarryStatus status) {
    report_.status = status;
    return std::move(report_);
  }

  bool GoesOn(const char* stage, int done, int total) {
    if (progress_ && !progress_(stage, done, total)) stopped_ = true;
    return !stopped_;
  }

  const HandModel& Hand(Side side) const { return side == Side::kRight ? right_ : left_; }

  const BodySurface& WholeBody() {
    if (!surface_) surface_.emplace(body_.model, body_.betas);
    return *surface_;
  }

  // Puts the object into the drinking hand; from then on it counts as the clip's own object.
  bool Serve() {
    report_.drink = ServeDrink(body_, object_, options_.seed, clip_);
    options_.hands = GraspHands::kAuto;
    options_.grasp = GraspSource::kClips;
    options_.place.reset();
    report_.holding = Always(HoldingBit(report_.drink->times.side), clip_.pose.size());
    report_.grasp.status = std::string(Describe(report_.drink->status));
    if (report_.drink->status == GraspStatus::kNoCleanGrasp) {
      report_.warnings.push_back(report_.grasp.status + "; using the best rejected grasp");
    }
    return report_.drink->status != GraspStatus::kNoRoom;
  }

  // Holding hands for an object that the clip lacks: those that held the clip's own in most frames.
  std::uint8_t UsualHolder() const {
    if (const std::optional<Side> lone = body_.model->LoneHand()) return HoldingBit(*lone);
    const auto frames = [&](std::uint8_t bits) {
      return std::ranges::count(clip_.holding_hand, bits);
    };
    const std::uint8_t one = frames(kHoldsLeft) > frames(kHoldsRight) ? kHoldsLeft : kHoldsRight;
    return frames(kHoldsBoth) > frames(one) ? kHoldsBoth : one;
  }

  // Holding hands per frame, before the fit.
  HoldLabels WhoHolds() const {
    const auto frames = static_cast<std::size_t>(clip_.NumFrames());
    const bool has_track = !needs_grasp_;
    const bool switches_given = !options_.handover.switch_frames.empty();
    const bool automatic = options_.hands == GraspHands::kAuto;
    // Without an object trajectory, some hand has to hold the object in every frame.
    const bool labeled = !clip_.holding_hand.empty() &&
                         (has_track || std::ranges::count(clip_.holding_hand, 0) == 0);
    HoldLabels holding;
    if (labeled && (options_.hand_over || automatic) && !switches_given) {
      holding = {clip_.holding_hand, SwitchesOf(clip_.holding_hand), {}};
    } else if (options_.hand_over && (!has_track || switches_given)) {
      Eigen::Vector3d extent = Extent(object_.object.mesh);
      std::sort(extent.begin(), extent.end());
      return FindHandovers(clip_, right_, left_, extent(1), options_.handover);
    } else if (!options_.hand_over && !automatic) {
      return Always(BitsOf(options_.hands), frames);
    } else if (!has_track) {
      return Always(UsualHolder(), frames);
    } else {
      holding = FindHolds(clip_, right_, left_, *object_.fit.distance, options_.threads);
    }
    if (std::ranges::all_of(holding.hands, [](std::uint8_t bits) { return bits == 0; })) {
      throw Error("the clip", "has an object that no hand holds",
                  "Select the holding hand with --hand, or make a new grasp with --regrasp");
    }
    return holding;
  }

  void TakeHold() {
    const std::vector<std::uint8_t>& hands = report_.holding.hands;
    const BodySurface& body = WholeBody();
    const double span = hands.front() == kHoldsBoth ? BothHandsOptions{}.max_width_m
                                                    : OppositionOptions{}.max_width_m;
    FirstGraspOptions search{options_.style, Place(span), options_.seed, options_.threads,
                             options_.use};
    if (hands.front() == kHoldsBoth) {
      report_.grasp = HoldInFirstFrame(right_, left_, object_, body, search, clip_);
      GoesOn("grasp", 100, 100);
      return;
    }
    const Side side = hands.front() == kHoldsLeft ? Side::kLeft : Side::kRight;
    if (options_.given) {
      report_.grasp = TakeGivenGrasp(Hand(side), object_, *options_.given, options_.threads, clip_);
      return;
    }
    const auto alone =
        std::ranges::find_if_not(hands, [&](std::uint8_t bits) { return bits == hands.front(); });
    if (!report_.holding.switches.empty()) PrepareFirstHandover(search);
    report_.grasp = GraspInFirstFrame(
        Hand(side), object_, body, static_cast<int>(alone - hands.begin()), search, clip_,
        [&](double share) { return GoesOn("grasp", static_cast<int>(100 * share), 100); });
  }

  GraspTransferOptions TransferOptions() const {
    GraspTransferOptions transfer;
    transfer.seed = options_.seed;
    transfer.threads = options_.threads;
    transfer.place = PlaceOfReceiver();
    transfer.correction_weight = 16.0;  // preserve the clip's motion
    return transfer;
  }

  // Penalizes first grasps by how far the receiving wrist has to deviate from the clip.
  void PrepareFirstHandover(FirstGraspOptions& search) {
    const HandSwitch& first = report_.holding.switches.front();
    const GraspTransferOptions transfer = TransferOptions();
    const auto receiver = std::make_shared<const GraspReceiver>(Hand(first.to), object_.object.mesh,
                                                                object_.solid.distance,
                                                                *object_.fit.distance, transfer);
    receivers_[first.to == Side::kRight ? 0 : 1] = receiver;
    const auto wrist = [&](Side side) {
      return WristIn(Hand(side), clip_.pose[first.both_begin], clip_.trans.col(first.both_begin));
    };
    const Eigen::Isometry3d receiver_from_giver = wrist(first.to).inverse() * wrist(first.from);
    const auto giver = std::make_shared<const HandAnatomy>(Hand(first.from));
    const double weight = transfer.correction_weight;
    search.also = [this, receiver, giver, receiver_from_giver, weight](const Grasp& grasp) {
      const double also =
          -weight * receiver->LeastCorrection(*giver, grasp.fingers, grasp.wrist_from_object,
                                              receiver_from_giver * grasp.wrist_from_object);
      to_hand_over_.emplace_back(grasp.score + also, grasp);
      return also;
    };
    const auto take_over = [receiver, giver, receiver_from_giver](const Grasp& grasp) {
      return receiver->TakeOver(giver->hand, grasp.fingers, grasp.wrist_from_object,
                                receiver_from_giver * grasp.wrist_from_object);
    };
    search.serves = [this, take_over, transfer](const Grasp& grasp) {
      if (!first_handover_) ChooseFirstHandover(take_over, transfer);
      return grasp.wrist_from_object.isApprox(first_handover_->first.wrist_from_object, 0.0) &&
             grasp.fingers == first_handover_->first.fingers;
    };
  }

  // Among the few most promising first grasps, selects the one that loses least in the actual
  // handover. Stops as soon as a wrist stays near the clip's.
  void ChooseFirstHandover(const std::function<GraspTransfer(const Grasp&)>& take_over,
                           const GraspTransferOptions& transfer) {
    constexpr std::size_t kMaxAsked = 4;
    constexpr double kNear_m = 0.05, kNotFound_m = 1.0;
    std::ranges::stable_sort(to_hand_over_, std::greater{}, &std::pair<double, Grasp>::first);
    double most = -std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < std::min(kMaxAsked, to_hand_over_.size()); ++k) {
      const Grasp& grasp = to_hand_over_[k].second;
      const GraspTransfer taken = take_over(grasp);
      const double correction = (taken.found ? 0.0 : kNotFound_m) + taken.correction_m +
                                transfer.lever_m * taken.correction_rad;
      const double worth = grasp.score - transfer.correction_weight * correction;
      if (worth <= most) continue;
      most = worth;
      first_handover_.emplace(grasp, taken);
      if (correction < kNear_m) break;
    }
  }

  std::shared_ptr<const GraspPlace> Place(double span_m) const {
    if (!options_.place) return nullptr;
    GraspPlace::Wanted wanted = *options_.place;
    wanted.span_m = span_m;
    return std::make_shared<const GraspPlace>(object_.object.mesh, wanted);
  }

  // Two hands cannot both be at one point; parts of the object apply to both.
  std::shared_ptr<const GraspPlace> PlaceOfReceiver() const {
    if (!options_.place) return nullptr;
    GraspPlace::Wanted wanted = *options_.place;
    wanted.at.reset();
    if (wanted.region.NumFaces() == 0 && wanted.avoid.NumFaces() == 0 &&
        wanted.avoid_balls.empty()) {
      return nullptr;
    }
    return std::make_shared<const GraspPlace>(object_.object.mesh, wanted);
  }

  void NameObject() {
    clip_.object->name = object_.object.name;
    clip_.object->mesh = "object.ply";
    // Betas keep the name of their body model; without betas, the clip now belongs to this body.
    if (clip_.betas.size() == 0 || clip_.betas.isZero(0.0)) {
      clip_.body_model = body_.model->Name();
    }
  }

  void Fit() {
    const std::vector<std::uint8_t>& holding = report_.holding.hands;
    for (const Side side : {Side::kRight, Side::kLeft}) {
      if ((report_.held_by & HoldingBit(side)) != 0) hands_.push_back(&Hand(side));
    }
    const bool hands_change =
        std::ranges::adjacent_find(holding, std::ranges::not_equal_to{}) != holding.end();
    const bool transfers = options_.hand_over || (needs_grasp_ && hands_change);
    std::vector<GraspTransfer> made;
    if (first_handover_) made.push_back(first_handover_->second);
    std::optional<Clip> met;
    if (transfers && !options_.keep_motion && options_.recipe == FitRecipe::kHoldfast) {
      met = WithHandsMeeting(made);
    }
    const Clip& source = met ? *met : clip_;
    if (stopped_) return;
    report_.fit =
        options_.recipe == FitRecipe::kImosCode
            ? FitClipImosCode(clip_, *hands_.front(), object_.fit.vertices, {}, GoesOnFitting())
            : FitClip(source, hands_, object_.fit, holding, options_.fit,
                      Grasps(transfers, std::move(made)), GoesOnFitting());
    report_.clip = std::move(report_.fit.clip);
    if (transfers || report_.drink || options_.clear_passages) {
      ClearPassages(source, hands_, *object_.fit.distance, options_.fit.release_s, report_.clip);
    }
  }

  // Grasps at the starts of holds; for receiving hands, the first ones are taken from `made`.
  GraspMaker Grasps(bool transfers, std::vector<GraspTransfer> made) {
    const GraspMaker later =
        transfers ? GraspsByTransfer(right_, left_, object_.object.mesh, object_.solid.distance,
                                     *object_.fit.distance, TransferOptions(), &report_.handovers,
                                     receivers_, std::move(made))
                  : GraspsFromClip(clip_, hands_);
    return [this, later](const GraspRequest& request) {
      const auto& both_poses = report_.grasp.poses;
      const bool both = request.frame == 0 && both_poses;
      return both ? (*both_poses)[request.side == Side::kRight ? 0 : 1] : later(request);
    };
  }

  std::function<bool(int, int)> GoesOnFitting() {
    return [this](int done, int total) { return GoesOn("fit", done, total); };
  }

  // Returns the clip with both arms sharing the correction at each handover, from a first
  // frame-by-frame fit. `made` receives all transfers.
  Clip WithHandsMeeting(std::vector<GraspTransfer>& made) {
    FitOptions once = options_.fit;
    once.whole_clip = false;
    const std::vector<std::uint8_t>& holding = report_.holding.hands;
    int last = 0;  // last start of a hold: only the grasps are needed
    for (int t = 1; t < clip_.NumFrames(); ++t) {
      if ((holding[t] & ~holding[t - 1]) != 0) last = t;
    }
    FitClip(clip_, hands_, object_.fit, holding, once, Grasps(true, made),
            [&](int t, int) { return GoesOn("fit", 0, clip_.NumFrames()) && t <= last; });
    made.clear();
    for (const Handover& handover : report_.handovers) made.push_back(handover.transfer);
    Clip met = clip_;
    LetHandsMeet(right_, left_, report_.holding.switches, report_.handovers, met);
    report_.handovers.clear();
    return met;
  }

  // The fit is sequential, so another thread prepares independent data meanwhile.
  void StartClearanceAsync() {
    if (options_.recipe != FitRecipe::kHoldfast || body_.model->LoneHand()) return;
    scene_ = std::async(options_.threads > 1 ? std::launch::async : std::launch::deferred,
                        [&body = WholeBody(), &object = object_.object.mesh,
                         holding = report_.holding.hands, frame_rate = clip_.frame_rate] {
                          return ClearanceScene(body, object, holding, frame_rate);
                        });
  }

  void ResolveBodyCollisions() {
    if (!scene_.valid()) return;
    ClearanceOptions clearance;
    clearance.keep_motion = options_.keep_motion;
    clearance.threads = options_.threads;
    ClearanceScene scene = scene_.get();
    scene.meeting.AddObject(*object_.fit.distance, report_.drink.has_value());
    report_.clearance =
        KeepOutOfBody(WholeBody(), object_.object.mesh, clearance, std::move(scene), report_.clip);
  }

  void Measure() {
    const std::vector<HandObjectScore> hands =
        MeasureHands(report_.clip, hands_, report_.holding.hands, object_.solid, options_.protocol,
                     [&](int done, int total) { return GoesOn("metrics", done, total); });
    report_.contact = ScoreContact(hands);
    WarnOfFreeHands(hands);
    for (Handover& handover : report_.handovers) MeasureChange(handover);
    if (!report_.drink) return;
    report_.drunk =
        MeasureDrink(report_.clip, report_.drink->times, WholeBody().RestJoints(),
                     FindFaceMarks(WholeBody()), MarksOf(object_.object.name, object_.object.mesh));
  }

  // Measures the changes of both wrists while both hands hold.
  void MeasureChange(Handover& handover) const {
    const std::vector<std::uint8_t>& hands = report_.holding.hands;
    int end = handover.frame + 1;
    while (end < std::ssize(hands) && hands[end] == kHoldsBoth) ++end;
    handover.receiver = LargestChange(Hand(handover.to), clip_, report_.clip, handover.frame, end);
    handover.giver =
        LargestChange(Hand(OtherSide(handover.to)), clip_, report_.clip, handover.frame, end);
  }

  void Warn() {
    // A grasp in the clip that the terms cannot repair any more: soft tissue compresses less.
    constexpr double kBadGrasp_mm = 3.0, kMinContact = 0.5;
    if (!needs_grasp_ && report_.contact.penetration_mean_max_mm > kBadGrasp_mm) {
      report_.warnings.push_back(
          fmt::format("in the clip's own grasp, the object is {:.0f} mm deep in the hand; "
                      "--regrasp makes a new one",
                      report_.contact.penetration_mean_max_mm));
    }
    const ClearanceReport& body = report_.clearance;
    const double contact = report_.contact.contact_frames_ratio.value_or(0.0);
    const bool through_body = !options_.keep_motion && IsThroughBody(body);
    report_.sound =
        report_.grasp.clean && contact >= kMinContact && !through_body && !through_hand_;
    for (std::string& warning : ClearanceWarnings(body)) {
      report_.warnings.push_back(std::move(warning));
    }
    if (options_.recipe != FitRecipe::kHoldfast && report_.grasp.through_body > 0.0) {
      report_.warnings.push_back(
          fmt::format("the object collides with the body in about {:.0f} % of the frames",
                      100.0 * report_.grasp.through_body));
    }
    WarnOfFaults();
    if (contact < kMinContact) {
      report_.warnings.push_back(fmt::format(
          "the holding hands touch the object in only {:.0f} % of the frames in which they hold it",
          100.0 * contact));
    }
    WarnOfDrink();
    for (const HandSwitch& change : report_.holding.switches) {
      constexpr double kDoubtful = 0.05;
      if (change.confidence >= kDoubtful) continue;
      report_.sound = false;
      report_.warnings.push_back(
          fmt::format("the hand-over found at frame {} is doubtful (confidence {:.2f}): give the "
                      "frames with --switch, or fit without a hand-over",
                      change.frame, change.confidence));
    }
    for (const Handover& handover : report_.handovers) {
      if (handover.transfer.found) continue;
      report_.sound = false;
      report_.warnings.push_back(
          fmt::format("the {} hand's grasp in frame {} is the best rejected one: {}",
                      SideName(handover.to), handover.frame, handover.transfer.refused));
    }
  }

  // A hand on its way to or from its hold that passes through the object.
  void WarnOfFreeHands(const std::vector<HandObjectScore>& hands) {
    constexpr double kMax_mm = 10.0;
    for (const HandObjectScore& hand : hands) {
      double worst = 0.0;
      std::size_t at = 0;
      for (std::size_t t = 0; t < hand.frames.size(); ++t) {
        const double depth = hand.Holds(t) ? 0.0 : hand.frames[t].DeepestPenetration_mm();
        if (depth <= worst) continue;
        worst = depth;
        at = t;
      }
      if (worst <= kMax_mm) continue;
      through_hand_ = true;
      report_.warnings.push_back(
          fmt::format("the {} hand, which does not hold, penetrates the object by {:.0f} mm in "
                      "frame {}",
                      SideName(hand.side), worst, at));
    }
  }

  // Captured drinkers tilt the neck by 10 to 17 degrees.
  void WarnOfDrink() {
    if (!report_.drunk) return;
    constexpr double kMaxFromMouth_m = 0.025, kMaxNeck = 45.0 * kDegree;
    if (report_.drunk->rim_from_mouth_m > kMaxFromMouth_m) {
      report_.sound = false;
      report_.warnings.push_back(fmt::format("the rim stays {:.0f} mm from the mouth",
                                             1e3 * report_.drunk->rim_from_mouth_m));
    }
    if (report_.drunk->neck_rad > kMaxNeck) {
      report_.sound = false;
      report_.warnings.push_back(
          fmt::format("the neck is tilted by {:.0f} degrees to bring the mouth to the rim",
                      report_.drunk->neck_rad / kDegree));
    }
  }

  // Warns of errors in custom terms, each with its first frame.
  void WarnOfFaults() {
    std::map<std::string, std::pair<std::size_t, int>> faults;  // first frame, number of frames
    const std::vector<FrameReport>& frames = report_.fit.frames;
    for (std::size_t t = 0; t < frames.size(); ++t) {
      if (!frames[t].fault.empty())
        ++faults.try_emplace(frames[t].fault, t, 0).first->second.second;
    }
    for (const auto& [fault, where] : faults) {
      report_.sound = false;
      report_.warnings.push_back(
          fmt::format("frame {}: {}; {} frame(s) keep their initial values because of it",
                      where.first, fault, where.second));
    }
  }

  Clip clip_;
  const ClipBody& body_;
  const PreparedObject& object_;
  CarryOptions options_;
  const StagedProgress& progress_;
  HandModel right_, left_;
  std::optional<BodySurface> surface_;
  bool needs_grasp_ = false;
  bool stopped_ = false;
  bool through_hand_ = false;  // a free hand passes through the object
  std::vector<const HandModel*> hands_;
  ReceivingHands receivers_;
  // Of the first handover, before the fit: first grasps with their scores, and the selected one.
  std::vector<std::pair<double, Grasp>> to_hand_over_;
  std::optional<std::pair<Grasp, GraspTransfer>> first_handover_;
  CarryReport report_;
  std::future<ClearanceScene> scene_;  // for ResolveBodyCollisions
};

// Whether another grasp may carry the object without these faults.
bool GraspIsAtFault(const CarryReport& report, const CarryOptions& options) {
  if (!report.grasp.made || options.given) return false;
  if (report.status == CarryStatus::kNoGrasp) return options.place.has_value();
  if (report.sound) return false;
  return !report.grasp.clean || (!options.keep_motion && IsThroughBody(report.clearance));
}

int Rank(const CarryReport& report) {
  if (report.status != CarryStatus::kCarried) return 0;
  return report.sound ? 3 : report.grasp.clean ? 2 : 1;
}

// Whether the object of a clip is this one: the same surface if the clip's mesh is known (as given
// or times `scale`), else the same name.
bool IsObjectOf(const Clip& clip, const std::optional<TriangleMesh>& clip_object,
                const LoadedObject& object, double scale) {
  if (!clip.object) return false;
  if (clip_object) {
    if (SameSurface(*clip_object, object.mesh)) return true;
    TriangleMesh scaled = *clip_object;
    scaled.vertices *= scale;
    return scale != 1.0 && SameSurface(scaled, object.mesh);
  }
  const auto same = [](unsigned char a, unsigned char b) {
    return std::tolower(a) == std::tolower(b);
  };
  const std::string mesh = std::filesystem::path(clip.object->mesh).stem().string();
  return clip.object->name.empty() || std::ranges::equal(clip.object->name, object.name, same) ||
         std::ranges::equal(mesh, object.name, same);
}

}  // namespace

bool NeedsGrasp(const Clip& clip, const LoadedObject& object, const CarryOptions& options) {
  if (!clip.object || options.grasp == GraspSource::kNew || options.place || options.given) {
    return true;
  }
  return !WhyNewGrasp(clip, object, object.name, options).empty();
}

std::string WhyNewGrasp(const Clip& clip, const LoadedObject& object, const std::string& name,
                        const CarryOptions& options) {
  if (!clip.object || options.grasp != GraspSource::kClipsOrNew || options.place) return {};
  const std::string& own = clip.object->name;
  if (!IsObjectOf(clip, options.clip_object, object, options.object_scale)) {
    if (own == name) return "the clip's grasp is of another mesh named " + own;
    return fmt::format("the clip's grasp is of {}, not of {}", own.empty() ? "another mesh" : own,
                       name);
  }
  if (options.other_body.empty()) return {};
  return fmt::format("the clip's grasp is of a hand of {}, which the loaded body does not have",
                     options.other_body);
}

CarryReport CarryObject(const Clip& clip, const ClipBody& body, const PreparedObject& object,
                        const CarryOptions& options, const StagedProgress& progress) {
  CarryReport report = Carrier(clip, body, object, options, progress).Run();
  // The seed decides which opposed places the grasp search tries.
  constexpr std::uint64_t kMoreSearches = 3;
  CarryOptions again = options;
  for (std::uint64_t k = 1; k <= kMoreSearches && GraspIsAtFault(report, options); ++k) {
    again.seed = MixSeed(options.seed, k);
    CarryReport other = Carrier(clip, body, object, again, progress).Run();
    if (other.status == CarryStatus::kStopped || Rank(other) > Rank(report)) {
      report = std::move(other);
    }
  }
  return report;
}

}  // namespace holdfast
