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
  std::vector<std::string> objects;  ///< embedded names; empty: all that an action has
  /// Folder of recorded markers with people who drink and comb (FindMarkerTrials): each trial is
  /// made once seated and once standing, besides `count`; empty: none.
  std::string captured = {};
  std::uint64_t seed = 1;
  int threads = 1;       ///< the result does not depend on them
  bool replace = false;  ///< a set in the folder that was made from something else
  /// Of the program, for the manifest: a set is resumed by the version that began it.
  std::string version = {};
};

/// One clip that is to be made.
struct ActionJob {
  int index = 0;
  std::string action, object;  ///< object by its embedded name
  int subject = 0;             ///< 0 is s1
  bool left = false;
  std::uint64_t seed = 0;
  std::string name;  ///< "s1/mug_drink_3": below the set's folder, without .npz
};

/// The clips of a set, by index. A longer set begins with a shorter one's. Actions by their shares,
/// objects with the first of each action's the oftenest, subjects in turn (each subject passes two
/// objects from hand to hand, no more: hands that fit each other are dear). Throws Error for an
/// unknown action, and for objects that no action is made with.
std::vector<ActionJob> PlanActions(const ActionSetOptions& options);

/// One clip that is to be made of a captured trial.
struct CapturedJob {
  int index = 0;
  MarkerTrialFiles files;
  RestPosture posture = RestPosture::kSeated;
  int subject = 0;
  bool held_out = false;
  std::uint64_t seed = 0;
};

/// Two clips of each trial in options.captured, one after the other: seated, and standing. By
/// index, from the largest ActionSetOptions::count on, so that scripted clips can be added later.
/// The last fifth of the people, at least one of several, is for held-out subjects, the others' are
/// made with the others; subjects in turn. None for an empty folder name. Throws what
/// FindMarkerTrials does.
inline constexpr int kMaxScripted = 1'000'000;
std::vector<CapturedJob> PlanCaptured(const ActionSetOptions& options);

/// Whether a subject is left-handed: evenly spread, the last one among them where any is.
bool IsLeftHanded(int subject, double share);

/// The last fifth of the subjects, at least one: made from other people's starts.
bool IsHeldOut(int subject, int subjects);

/// Shape of a subject: `count` coefficients, normal with standard deviation 0.9, at most 2.
Eigen::VectorXd SubjectBetas(int subject, int count, std::uint64_t seed);

}  // namespace holdfast
