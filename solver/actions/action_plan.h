// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "solver/markers/marked_person.h"
#include "solver/markers/marker_world.h"

namespace holdfast {

struct ActionSetOptions {
  int count = 600;
  int subjects = 10;
  double left_share = 0.2;           ///< of left-handed subjects
  bool wrist_blows = false;          ///< as in ActionScene
  std::vector<std::string> actions;  ///< empty: all
  std::vector<std::string> objects;  ///< embedded names; empty: all objects of each action
  /// Folder of marker recordings of people who drink and comb (FindMarkerTrials): each trial adds a
  /// seated and a standing clip to `count`; empty: none.
  std::string captured = {};
  std::uint64_t seed = 1;
  int threads = 1;       ///< does not affect the result
  bool replace = false;  ///< replace a set in the folder that has other provenance
  /// Program version, for the manifest: a set can only be resumed by the version that began it.
  std::string version = {};
};

/// A clip to synthesize.
struct ActionJob {
  int index = 0;
  std::string action, object;  ///< embedded name of the object
  int subject = 0;             ///< 0 is s1
  bool left = false;
  std::uint64_t seed = 0;
  std::string name;  ///< "s1/mug_drink_3": relative to the set's folder, without .npz
};

/// Returns the clips of a set, by index. A shorter set is a prefix of a longer one. Actions follow
/// their shares; the first objects of an action are the most frequent; subjects alternate. Each
/// subject passes only two objects from hand to hand, because pairs of grasps are expensive. Throws
/// Error for an unknown action, and for objects that no action uses.
std::vector<ActionJob> PlanActions(const ActionSetOptions& options);

/// A clip to synthesize from a captured trial.
struct CapturedJob {
  int index = 0;
  MarkerTrialFiles files;
  RestPosture posture = RestPosture::kSeated;
  int subject = 0;
  bool held_out = false;
  std::uint64_t seed = 0;
};

/// Returns two consecutive clips per trial in options.captured: seated and standing. Indices start
/// at the largest ActionSetOptions::count, so that scripted clips can be added later. The last
/// fifth of the people (at least one of several) is assigned to held-out subjects, the others to
/// the remaining subjects; subjects alternate. Empty for an empty folder name. Throws as
/// FindMarkerTrials does.
inline constexpr int kMaxScripted = 1'000'000;
std::vector<CapturedJob> PlanCaptured(const ActionSetOptions& options);

/// The last fifth of the subjects, at least one: synthesized from other people's starts.
bool IsHeldOut(int subject, int subjects);

/// Shape of a subject: `count` normal coefficients, standard deviation 0.9, clamped to 2.
Eigen::VectorXd SubjectBetas(int subject, int count, std::uint64_t seed);

}  // namespace holdfast
