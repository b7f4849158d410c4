// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "generator/scripted/reach_motion.h"
#include "generator/wandr/reach_network.h"
#include "generator/wandr/reach_outcome.h"
#include "generator/wandr/reach_protocol.h"
#include "solver/evaluation/study_blocks.h"

namespace holdfast {

/// A row of the ablation table (Table 2 of the paper).
struct ReachVariant {
  std::string key;    ///< "full", "wrist", "wrist+pelvis", "wrist+heading", "none"
  std::string label;  ///< for people
  wandr::IntentionParts parts;
  bool with_intention = true;
  bool refitted = false;  ///< feet pinned, the wrist placed where it reached: as `reach` gives them
  /// The paper's; empty where it has none.
  std::optional<double> paper_success, paper_skating, paper_distance_m;
};
const std::vector<ReachVariant>& ReachVariants();

/// A motion of the protocol, measured.
struct StudyMotion {
  wandr::ReachOutcome outcome;
  double surface_skating = 0.0;  ///< FS exactly: SkatingOfLowestVertex
};

/// As one row of a file, and back to the last bit. The second throws nlohmann::json::exception for
/// rows that are none.
nlohmann::json StudyRow(const StudyMotion& motion);
StudyMotion StudyMotionOf(const nlohmann::json& row);

/// RefitRollout of a motion of the protocol, right wrist; one whose numbers broke stays as it is.
void RefitToGoal(const BodyMeasures& measures, const Eigen::Vector3d& goal,
                 wandr::RolloutTrack& track);

/// Over many of them.
struct StudySummary {
  wandr::ReachSummary reach;
  double surface_skating = 0.0;
};
StudySummary SummarizeMotions(std::span<const StudyMotion> motions);

/// What a study asks: everything that its results depend on.
struct ReachQuestion {
  std::vector<wandr::ReachStart> starts;
  wandr::ReachProtocol protocol;
  std::string variant;
  bool refitted = false;
  const ReachNetwork* network = nullptr;

  std::string Checksum() const;
};

/// Runs a protocol in blocks that are kept in files, so that a stopped study can be resumed.
class ReachStudy {
 public:
  /// `folder` is made. With `replace`, blocks of another configuration are replaced; otherwise they
  /// throw Error.
  ReachStudy(std::filesystem::path folder, const wandr::LowestPoint& lowest,
             const BodyMeasures& body, bool replace, int threads);

  /// Blocks of this question (named `name`) that there are already, as a number of motions.
  int NumDone(const ReachQuestion& question, const std::string& name) const;
  /// All motions in the order of ReachCases. `progress` sees each that is run. What it throws ends
  /// the run, with all complete blocks kept.
  std::vector<StudyMotion> Run(const ReachQuestion& question, const std::string& name,
                               const std::function<void()>& progress) const;

 private:
  /// The motions of a block in a file; nothing when there is none (of this question, with force).
  std::optional<std::vector<StudyMotion>> Load(const std::string& name, int block,
                                               const std::string& checksum, int count) const;

  StudyBlocks blocks_;
  const wandr::LowestPoint& lowest_;
  const BodyMeasures& body_;
  wandr::BoneOffsets<float> bones_;
  int threads_;
};

}  // namespace holdfast
