// SPDX-License-Identifier: MIT
#include "solver/transfer/variants.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <fstream>
#include <map>
#include <memory>
#include <mutex>
#include <sstream>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "generator/nn/random_stream.h"
#include "geometry/body/own_body.h"
#include "geometry/clip/clip_arrays.h"
#include "geometry/error.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/json_file.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/parallel.h"
#include "geometry/rotation.h"
#include "geometry/seed.h"
#include "solver/fit/clip_state.h"
#include "solver/grasp/grasp_assessment.h"
#include "solver/handover/holds.h"
#include "solver/transfer/transfer.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;
using Eigen::Isometry3d;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;
using nlohmann::json;

constexpr const char* kManifest = "manifest.jsonl";
constexpr int kBlock = 64;           // maximum tries between manifest updates
constexpr int kFewestTries = 256;    // eight object shapes
constexpr int kMaxTriesEach = 8;     // limit of tries per variant
constexpr int kPerShape = 32;        // tries per object shape, whose preparation is most expensive
constexpr double kMaxBody_mm = 5.0;  // of the object in the person, in any of ten frames

// Reads the complete lines of the manifest of a folder of variants, of which the first is the
// request, and counts its tries. Empty if there is none yet. Throws Error for a folder that holds
// something else, or variants of another `asked`.
std::string ReadManifest(const fs::path& path, const json& asked, VariantReport& report) {
  const fs::path folder = path.parent_path();
  std::string lines;
  if (!fs::exists(path)) {
    if (fs::exists(folder) && !fs::is_empty(folder)) {
      throw Error(folder.string(), "is not a folder of variants: nothing is written there",
                  "Choose another name");
    }
    return lines;
  }
  std::istringstream text(ReadFile(path));
  bool first = true;
  for (std::string line; std::getline(text, line);) {
    const json entry = json::parse(line, nullptr, false);
    if (entry.is_discarded() || !entry.is_object()) break;  // interrupted while writing
    if (first && entry != asked) {
      throw Error(folder.string(), "holds variants of another clip, options or seed",
                  "Choose another folder");
    }
    if (!first) {
      if (entry.value("variant", -1) != report.tried) break;
      ++report.tried;
      report.kept += entry.value("kept", false);
      if (!entry.value("kept", false)) ++report.refused[entry.value("why", "")];
    }
    first = false;
    lines += line + "\n";
  }
  report.had = report.tried;
  return lines;
}

// Depth in both directions and contact of a hold over its frames. If skin near the object has moved
// little since a measured frame, depth and distance are bounded by that motion.
struct HoldMeasure {
  double deepest_mm = 0.0;
  int frames = 0, touching = 0;
};

// Measures the frames of `hold`; skin closer than `touch_m` is in contact.
HoldMeasure MeasureHold(const Clip& clip, const CarryingHand& hand, const GraspCarrier& carrier,
                        const PreparedObject& object, const TransferredHold& hold, double touch_m) {
  constexpr double kNear_m = 0.03, kLittle_m = 0.0004;
  HoldMeasure measure;
  HandState state(hand.to);
  Matrix3Xd measured, skin;
  std::vector<int> near;
  double least = 0.0, deepest = 0.0;  // meters, of the last measured frame
  for (int t = hold.begin; t < hold.end; ++t) {
    const auto frame = static_cast<std::size_t>(t);
    state.SetBody(clip.pose[frame], clip.trans.col(t));
    state.Evaluate(FingersOf(clip.pose[frame], hold.side), false);
    const Matrix3Xd vertices = clip.object->Pose(t).inverse() * state.Vertices();
    ++measure.frames;
    double moved = measured.cols() == 0 ? 1.0 : 0.0;
    for (const int i : near) moved = std::max(moved, (vertices.col(i) - measured.col(i)).norm());
    if (moved < kLittle_m) {
      measure.touching += least + moved < touch_m;
      measure.deepest_mm = std::max(measure.deepest_mm, 1e3 * (deepest + moved));
      continue;
    }
    SkinPositions(hand.anatomy.landmarks, vertices, skin);
    const Eigen::VectorXd distance = SkinDistances(hand.anatomy.landmarks, *object.fit.distance,
                                                   Isometry3d::Identity(), skin, kNear_m);
    least = distance.minCoeff();
    deepest = std::max({0.0, -least, carrier.ObjectInHand(vertices, Isometry3d::Identity())});
    measure.touching += least < touch_m;
    measure.deepest_mm = std::max(measure.deepest_mm, 1e3 * deepest);
    measured = vertices;
    near.clear();
    for (Eigen::Index i = 0; i < vertices.cols(); ++i) {
      if (distance(i) < kNear_m) near.push_back(static_cast<int>(i));
    }
  }
  return measure;
}

// Depth of the object in the person's body, meters: maximum over ten frames in which it is held.
double ObjectDepthInBody(const Clip& clip, const BodySurface& skin, const OwnBody& obstacle,
                         const PreparedObject& object) {
  constexpr int kFrames = 10;
  double deepest = 0.0;
  BodyState state;
  for (int k = 0; k < std::min(kFrames, clip.NumFrames()); ++k) {
    const int t = static_cast<int>((clip.NumFrames() - 1.0) * k / (kFrames - 1));
    if (clip.holding_hand[t] == 0) continue;
    Forward(skin, clip.pose[t], clip.trans.col(t), state);
    const Matrix3Xd points = clip.object->Pose(t) * object.fit.vertices;
    const OwnBody::Posed posed(obstacle, state.vertices, points.rowwise().minCoeff(),
                               points.rowwise().maxCoeff(), 0.03);
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      if (const auto touch = posed.Query(points.col(i))) deepest = std::max(deepest, touch->depth);
    }
  }
  return deepest;
}

// An object shape, shared by several tries.
struct Shape {
  Vector3d scale = Vector3d::Ones();
  std::shared_ptr<const PreparedObject> object;
  std::shared_ptr<const SurfaceMap> map;
};

// Result of a try.
struct Attempt {
  json line;
  bool kept = false;
  Clip clip;
  int shape = 0;
  bool mirrored = false;
};

std::uint64_t Seed(const VariantOptions& options, int kind, int index) {
  return MixSeed(MixSeed(options.seed, static_cast<std::uint64_t>(kind)),
                 static_cast<std::uint64_t>(index));
}

json HeadOf(const Clip& clip, const PreparedObject& object, const VariantOptions& options) {
  return {{"schema", "holdfast/variants/1"},    {"seed", options.seed},
          {"frames", clip.NumFrames()},         {"frame_rate", clip.frame_rate},
          {"object", object.object.name},       {"scale", {options.scale_low, options.scale_high}},
          {"axis_spread", options.axis_spread}, {"betas_sigma", options.betas_sigma},
          {"yaw_rad", options.yaw_rad},         {"place_m", options.place_m},
          {"mirrored", options.mirrored},       {"per_shape", kPerShape},
          {"bodies", options.bodies},           {"max_depth_mm", options.max_depth_mm},
          {"max_body_mm", kMaxBody_mm},         {"touch_mm", options.touch_mm}};
}

void Check(const VariantOptions& options) {
  const auto fault = [](const char* what, const char* remedy) {
    throw Error("variants", what, remedy);
  };
  if (options.count < 1 || options.count > 1'000'000) {
    fault("count is out of range", "Ask for 1 to 1000000");
  }
  if (!(options.scale_low > 0.05) || !(options.scale_high < 20.0) ||
      !(options.scale_low <= options.scale_high)) {
    fault("the range of scales is invalid", "Give a lower and an upper scale between 0.05 and 20");
  }
  if (!(options.axis_spread >= 0.0 && options.axis_spread < 0.5)) {
    fault("the spread of axes is out of range", "Give a fraction between 0 and 0.5");
  }
  if (!(options.mirrored >= 0.0 && options.mirrored <= 1.0)) {
    fault("the fraction of mirrored variants is out of range", "Give a fraction between 0 and 1");
  }
}

// Data shared by all variants of a demonstration.
class VariantMaker {
 public:
  VariantMaker(const Clip& clip, const ClipBody& body, const PreparedObject& object,
               const VariantOptions& options)
      : clip_(clip), body_(body), object_(object), options_(options) {
    if (body.model->LoneHand()) options_.bodies = 1;
    PrepareBodies();
  }

  // Prepares the shapes of tries [begin, end) in parallel.
  void Prepare(int begin, int end) {
    const int first = begin / kPerShape, last = (end - 1) / kPerShape;
    if (static_cast<int>(shapes_.size()) <= last)
      shapes_.resize(static_cast<std::size_t>(last) + 1);
    ParallelFor(last - first + 1, options_.threads, [&](int k) {
      Shape& shape = shapes_[first + k];
      if (!shape.object) shape = MakeShape(first + k);
    });
  }
  // Releases what only tries before `begin` used.
  void Forget(int begin) {
    for (int k = 0; k < begin / kPerShape; ++k) shapes_[k] = {};
  }

  Attempt Try(int index) const;

  const Shape& ShapeOf(int shape) const { return shapes_[shape]; }

 private:
  struct Person {
    ClipBody body;
    std::unique_ptr<const TransferHands> hands;
    std::unique_ptr<const BodySurface> skin;
    std::unique_ptr<const OwnBody> obstacle;  // without the holding arms
    OntoBody onto;
  };

  void PrepareBodies() {
    people_.resize(static_cast<std::size_t>(options_.bodies));
    ParallelFor(options_.bodies, options_.threads, [&](int k) {
      Person& person = people_[k];
      person.body = body_;
      if (k > 0 && !body_.model->IsSubject() && body_.model->NumShape() > 0) {
        RandomDraws draws(Seed(options_, 1, k));
        const int shown = std::min(2, body_.model->NumShape());
        Eigen::VectorXd betas = body_.betas;
        if (betas.size() < shown) betas.conservativeResizeLike(Eigen::VectorXd::Zero(shown));
        for (int b = 0; b < shown; ++b) {
          betas(b) += options_.betas_sigma * std::clamp(draws.Normal(), -2.5, 2.5);
        }
        person.body.betas = betas;
      }
      person.hands = std::make_unique<const TransferHands>(body_, person.body);
      person.onto = k == 0 ? OntoBody{clip_, {}} : OntoOtherBody(clip_, body_, person.body);
      std::uint8_t held_by = 0;
      for (const std::uint8_t bits : clip_.holding_hand) held_by |= bits;
      person.skin = std::make_unique<const BodySurface>(person.body.model, person.body.betas);
      if (!body_.model->LoneHand()) {
        person.obstacle = std::make_unique<const OwnBody>(*person.skin, held_by);
      }
    });
  }

  Shape MakeShape(int index) const {
    RandomDraws draws(Seed(options_, 2, index));
    Shape shape;
    const double uniform =
        std::exp(draws.Uniform(std::log(options_.scale_low), std::log(options_.scale_high)));
    for (int axis = 0; axis < 3; ++axis) {
      shape.scale(axis) =
          uniform * (1.0 + draws.Uniform(-options_.axis_spread, options_.axis_spread));
    }
    // As PrepareObject, but simplified and sampled once for all shapes.
    LoadedObject scaled = object_.object;
    scaled.mesh.vertices = shape.scale.asDiagonal() * scaled.mesh.vertices;
    Solid solid(scaled.mesh);
    TriangleMesh simplified = object_.simplified;
    simplified.vertices = shape.scale.asDiagonal() * simplified.vertices;
    FitObject fit;
    fit.vertices = simplified.vertices;
    fit.surface = shape.scale.asDiagonal() * object_.fit.surface;
    fit.distance = std::make_shared<const DistanceGrid>(solid.distance);
    shape.object = std::make_shared<const PreparedObject>(PreparedObject{
        std::move(scaled), std::move(solid), std::move(simplified), std::move(fit), {}});
    shape.map =
        std::make_shared<const SurfaceMap>(SurfaceMap::Scaled(object_.object.mesh, shape.scale));
    return shape;
  }

  const Clip& clip_;
  const ClipBody& body_;
  const PreparedObject& object_;
  VariantOptions options_;
  std::vector<Shape> shapes_;
  std::vector<Person> people_;
};

// Rotates the scene about the vertical and translates it.
void MoveScene(double yaw_rad, const Eigen::Vector2d& shift, const Vector3d& root, Clip& clip) {
  const Eigen::Matrix3d turn = ExpSO3(Vector3d(0.0, 0.0, yaw_rad));
  const Vector3d way(shift.x(), shift.y(), 0.0);
  for (int t = 0; t < clip.NumFrames(); ++t) {
    JointPose& pose = clip.pose[t];
    const Vector3d before = t == 0 ? Vector3d::Zero().eval()
                                   : Vector3d(clip.pose[static_cast<std::size_t>(t) - 1].col(0));
    pose.col(0) = UnwrapAxisAngle(LogSO3(turn * ExpSO3(Vector3d(pose.col(0)))), before);
    clip.trans.col(t) = turn * (root + clip.trans.col(t)) - root + way;
    for (std::optional<ObjectTrack>* track : {&clip.object, &clip.table}) {
      if (!*track) continue;
      const Isometry3d at = (*track)->Pose(t);
      (*track)->SetPose(t, RigidTransform(turn * at.linear(), turn * at.translation() + way));
    }
  }
}

Attempt VariantMaker::Try(int index) const {
  RandomDraws draws(Seed(options_, 3, index));
  Attempt attempt;
  attempt.shape = index / kPerShape;
  const Shape& shape = ShapeOf(attempt.shape);
  const auto who = static_cast<std::size_t>(draws.Index(options_.bodies));
  const Person& person = people_[who];
  attempt.mirrored = draws.Uniform(0.0, 1.0) < options_.mirrored && !body_.model->LoneHand();
  const double yaw = draws.Uniform(-options_.yaw_rad, options_.yaw_rad);
  const Eigen::Vector2d shift(draws.Uniform(-options_.place_m, options_.place_m),
                              draws.Uniform(-options_.place_m, options_.place_m));
  TransferOptions transfer;
  transfer.search = false;
  transfer.carry.seed = options_.seed;
  // With one hand holding throughout, the object has no world trajectory to keep.
  const std::uint8_t first = clip_.holding_hand.front();
  const bool alone =
      first != (kHoldsRight | kHoldsLeft) &&
      std::ranges::all_of(clip_.holding_hand, [&](std::uint8_t bits) { return bits == first; });
  transfer.keeps = alone ? TransferKeeps::kWrists : TransferKeeps::kObject;
  TransferReport report;
  report.body = person.onto.report;
  std::vector<std::unique_ptr<const GraspCarrier>> carriers;
  attempt.clip = PrepareTransfer(clip_, body_, object_, person.body, *shape.object, *shape.map,
                                 *person.hands, transfer, report, &person.onto.clip, &carriers);
  std::string why;
  HoldMeasure worst;
  for (const TransferredHold& hold : report.holds) {
    if (why.empty() && !hold.grasp.clean) why = "grasp";
  }
  if (why.empty() && report.arms.shortfall_m > 0.002) why = "reach";
  if (why.empty()) {
    for (const TransferredHold& hold : report.holds) {
      const std::size_t h = hold.side == Side::kRight ? 0 : 1;
      const HoldMeasure measure =
          MeasureHold(attempt.clip, *person.hands->carrying[h], *carriers[h], *shape.object, hold,
                      1e-3 * options_.touch_mm);
      worst.deepest_mm = std::max(worst.deepest_mm, measure.deepest_mm);
      worst.frames += measure.frames;
      worst.touching += measure.touching;
    }
    if (worst.deepest_mm > options_.max_depth_mm) why = "depth";
    if (why.empty() && worst.touching < worst.frames) why = "contact";
    if (why.empty() && person.obstacle &&
        1e3 * ObjectDepthInBody(attempt.clip, *person.skin, *person.obstacle, *shape.object) >
            kMaxBody_mm) {
      why = "body";
    }
  }
  attempt.kept = why.empty();
  const Matrix3Xd& rest = person.skin->RestJoints();
  if (attempt.kept) {
    if (attempt.mirrored) attempt.clip = MirrorClip(attempt.clip, rest.col(0));
    MoveScene(yaw, shift, rest.col(0), attempt.clip);
    attempt.clip.object->mesh =
        fmt::format("object_{:03d}{}.ply", attempt.shape, attempt.mirrored ? "_m" : "");
  }
  attempt.line = {
      {"variant", index},
      {"kept", attempt.kept},
      {"scale", {shape.scale.x(), shape.scale.y(), shape.scale.z()}},
      {"betas", std::vector<double>(person.body.betas.begin(), person.body.betas.end())},
      {"mirrored", attempt.mirrored},
      {"yaw_rad", yaw},
      {"shift_m", {shift.x(), shift.y()}}};
  if (attempt.kept) {
    attempt.line["file"] = fmt::format("v{:05d}.npz", index);
    attempt.line["object"] = attempt.clip.object->mesh;
    attempt.line["deepest_mm"] = worst.deepest_mm;
    attempt.line["in_contact_ratio"] = static_cast<double>(worst.touching) / worst.frames;
    attempt.line["contacts_off_mm"] = report.holds.front().grasp.contact_off_mm;
  } else {
    attempt.line["why"] = why;
    if (why == "grasp") {
      for (const TransferredHold& hold : report.holds) {
        if (!hold.grasp.clean) attempt.line["grasp"] = hold.grasp.refused;
      }
    }
    attempt.clip = {};
  }
  return attempt;
}

}  // namespace

VariantReport MakeVariants(const Clip& clip, const ClipBody& body, const PreparedObject& object,
                           const fs::path& folder, const VariantOptions& options,
                           const StagedProgress& progress) {
  Check(options);
  if (!clip.object) {
    throw Error("the clip", "has no object: there is nothing to make variants of",
                "Fit one to it first ('holdfast fit')");
  }
  const auto begin = std::chrono::steady_clock::now();
  const json head = HeadOf(clip, object, options);
  VariantReport report;
  std::string before = ReadManifest(folder / kManifest, head, report);
  if (before.empty()) before = JsonText(head) + "\n";
  fs::create_directories(folder);
  WriteAtomically(folder / kManifest, before);
  std::ofstream manifest(folder / kManifest, std::ios::app);

  Clip labeled = clip;
  if (labeled.holding_hand.empty()) {  // found once for all
    const HandModel right(body.model, body.betas, Side::kRight),
        left(body.model, body.betas, Side::kLeft);
    labeled.holding_hand =
        FindHolds(clip, right, left, *object.fit.distance, options.threads).hands;
  }
  VariantMaker maker(labeled, body, object, options);
  const int most = std::max(kFewestTries, kMaxTriesEach * options.count);
  bool stopped = false;
  while (report.kept < options.count && report.tried < most && !stopped) {
    const int first = report.tried, missing = options.count - report.kept;
    const int last = std::min(first + std::clamp(2 * missing, 8, kBlock), most);
    maker.Prepare(first, last);
    std::vector<Attempt> attempts(static_cast<std::size_t>(last - first));
    std::mutex lock;
    std::atomic<int> kept = report.kept;
    std::atomic<bool> stop = false;
    ParallelFor(last - first, options.threads, [&](int k) {
      if (stop) return;
      Attempt& attempt = attempts[k];
      attempt = maker.Try(first + k);
      if (attempt.kept) {
        const TriangleMesh& surface = maker.ShapeOf(attempt.shape).object->object.mesh;
        WriteClip(attempt.clip, attempt.mirrored ? MirrorMesh(surface) : surface,
                  folder / attempt.line["file"].get<std::string>());
        attempt.clip = {};
        ++kept;
      }
      if (!progress) return;
      const std::lock_guard guard(lock);
      if (!progress("variants", std::min<int>(kept, options.count), options.count)) stop = true;
    });
    stopped = stop;
    if (stopped) break;
    // In order, and no more than requested.
    for (const Attempt& attempt : attempts) {
      if (report.kept == options.count) {
        if (attempt.kept) fs::remove(folder / attempt.line["file"].get<std::string>());
        continue;
      }
      ++report.tried;
      if (attempt.kept) {
        ++report.kept;
        const fs::path mesh = folder / attempt.line["object"].get<std::string>();
        const TriangleMesh& surface = maker.ShapeOf(attempt.shape).object->object.mesh;
        if (!fs::exists(mesh)) WriteMesh(attempt.mirrored ? MirrorMesh(surface) : surface, mesh);
      } else {
        ++report.refused[attempt.line["why"].get<std::string>()];
      }
      manifest << JsonText(attempt.line) << '\n';
    }
    manifest.flush();
    maker.Forget(report.tried);
  }
  report.complete = !stopped;
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return report;
}

}  // namespace holdfast
