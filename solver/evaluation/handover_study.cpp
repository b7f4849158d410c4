// SPDX-License-Identifier: MIT
#include "solver/evaluation/handover_study.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <span>
#include <utility>

#include "geometry/embedded.h"
#include "geometry/error.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/mesh/distance_grid.h"
#include "geometry/parallel.h"
#include "solver/handover/handover_search.h"
#include "solver/handover/holds.h"

namespace holdfast {
namespace {

constexpr std::array<const char*, 8> kObjects = {"apple",  "sphere", "cylinder", "cube",
                                                 "bottle", "banana", "mug",      "camera"};

TriangleMesh EmbeddedObject(const std::string& name) {
  const std::string path = "objects/" + name + ".ply";
  const std::span<const std::byte> bytes = FindEmbedded(path).bytes;
  return ReadMeshBytes({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, path).mesh;
}

std::vector<int> FramesOf(const HoldLabels& holding) {
  std::vector<int> frames;
  for (const HandSwitch& change : holding.switches) frames.push_back(change.frame);
  return frames;
}

bool SameWithin(const std::vector<int>& found, const std::vector<int>& truth, double frames) {
  if (found.size() != truth.size()) return false;
  for (std::size_t k = 0; k < truth.size(); ++k) {
    if (std::abs(found[k] - truth[k]) > frames) return false;
  }
  return true;
}

}  // namespace

HandoverStudy RunHandoverStudy(const std::shared_ptr<const BodyModel>& body,
                               const HandoverStudyOptions& options) {
  const BodyMeasures measures = MeasureBody(*body, {});
  const HandModel right(body, {}, Side::kRight), left(body, {}, Side::kLeft);
  struct Object {
    TriangleMesh mesh;
    DistanceGrid grid;
  };
  std::vector<Object> objects;
  for (const char* name : kObjects) {
    TriangleMesh mesh = EmbeddedObject(name);
    DistanceGridOptions grid_options;
    grid_options.cell_m = 0.004;  // a hand's skin is known no better in a noisy clip
    grid_options.threads = options.threads;
    DistanceGrid grid(SignedDistance(mesh), grid_options);
    objects.push_back({std::move(mesh), std::move(grid)});
  }

  HandoverStudy study;
  study.clips.resize(static_cast<std::size_t>(options.count));
  const double tolerance = options.tolerance_s * options.frame_rate + 1e-9;
  ParallelFor(options.count, options.threads, [&](int i) {
    HandoverStudyClip& clip = study.clips[i];
    clip.seed = options.seed + static_cast<std::uint64_t>(i);
    const std::size_t kind = clip.seed % kObjects.size();
    const Object& object = objects[kind];
    clip.object = kObjects[kind];
    HandoverOptions drawn;
    drawn.seed = clip.seed;
    drawn.frame_rate = options.frame_rate;
    HandoverMotion motion =
        MakeHandoverMotion(measures, PalmGrasps(measures, object.mesh.vertices, clip.seed), drawn);
    clip.truth = motion.switch_frames;
    const std::vector<std::uint8_t> truth = std::exchange(motion.clip.holding_hand, {});
    AddNoise(motion.clip, options.noise, clip.seed);

    const HoldLabels held = FindHolds(motion.clip, right, left, object.grid);
    clip.with_object = FramesOf(held);
    clip.found_with_object = SameWithin(clip.with_object, clip.truth, tolerance);
    int same = 0;
    for (std::size_t t = 0; t < truth.size(); ++t) same += held.hands[t] == truth[t] ? 1 : 0;
    clip.hands_right = same / static_cast<double>(truth.size());

    motion.clip.object.reset();
    Eigen::Vector3d extent = Extent(object.mesh);
    std::sort(extent.data(), extent.data() + 3);
    try {
      clip.without_object = FramesOf(FindHandovers(motion.clip, right, left, extent.y()));
    } catch (const Error&) {
      clip.without_object.clear();  // it sees no hands meet: not found
    }
    clip.found_without_object = SameWithin(clip.without_object, clip.truth, tolerance);
  });

  int switches = 0;
  for (const HandoverStudyClip& clip : study.clips) {
    study.found_with_object += clip.found_with_object ? 1 : 0;
    study.found_without_object += clip.found_without_object ? 1 : 0;
    study.hands_right += clip.hands_right / options.count;
    if (clip.with_object.size() != clip.truth.size()) continue;
    for (std::size_t k = 0; k < clip.truth.size(); ++k, ++switches) {
      study.mean_error_frames += std::abs(clip.with_object[k] - clip.truth[k]);
    }
  }
  if (switches > 0) study.mean_error_frames /= switches;
  return study;
}

}  // namespace holdfast
