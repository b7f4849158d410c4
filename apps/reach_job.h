// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "apps/common.h"
#include "apps/fit_job.h"

namespace holdfast::apps {

/// One reach, as the command line asks for it.
struct ReachJob {
  std::vector<std::string> goals;  ///< "X,Y,Z", world metres, z up
  std::string from;                ///< CLIP or CLIP:FRAME; empty: stands at the origin
  std::string body;                ///< body model file
  std::string weights;             ///< empty: the embedded network
  std::string wrist = "right";
  std::optional<double> time_s;  ///< for each goal; empty: by its distance
  int samples = 16;
  double sigma = 1.0;
  bool all = false;  ///< keep every sample
  bool write_report = true;
  std::string output = "reach";
};

/// Three finite numbers. Throws Error naming what is wrong.
Eigen::Vector3d ParseGoal(const std::string& text);

/// "clip.npz:40" as a clip and its frame; without a number the frame is empty (the last). A file
/// whose name is all of the text is that file.
std::pair<std::string, std::optional<int>> ParseStart(const std::string& text);

/// Makes the motions, chooses one, and writes the result folder: clip.npz, metrics.json,
/// report.html, and with `all` samples/NN.npz. Throws FitFailure when the network's numbers break
/// in every sample.
FitOutcome RunReachJob(const ReachJob& job, const CommonOptions& common);

}  // namespace holdfast::apps
