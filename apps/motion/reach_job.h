// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "apps/common.h"
#include "solver/reach/reach_options.h"

namespace holdfast::apps {

/// One reach, as the command line asks for it.
struct ReachJob {
  std::vector<std::string> goals;   ///< "X,Y,Z", world metres, z up
  std::string track;                ///< in place of them: a table of goals, one a frame
  std::optional<double> rate_hz;    ///< of that table
  std::vector<std::string> pushes;  ///< "FRAME,DX,DY,DZ"
  std::string from;                 ///< CLIP or CLIP:FRAME; empty: stands at the origin
  std::string body;                 ///< body model file
  std::string weights;              ///< empty: the embedded network
  std::string wrist = "right";
  std::optional<double> time_s;        ///< for each goal; empty: what turning and walking take
  std::string method;                  ///< intention, latent-opt, vae-opt; empty: Method()
  std::optional<int> samples;          ///< motions to choose from; empty: by the method
  std::string optimizer;               ///< vae-opt: lm, lbfgs, lbfgs-step1, adam; empty: lm
  std::optional<int> iterations;       ///< vae-opt
  std::optional<double> prior_weight;  ///< vae-opt
  bool refit = true;                   ///< pin feet and place the wrist afterwards
  bool free_time = false;  ///< latent-opt: arrive when it suits, until the deadline or so
  std::string approach;    ///< latent-opt: "X,Y,Z", along the forearm on arrival; or empty
  std::vector<std::string> obstacles;  ///< mesh files, world
  std::string object;                  ///< mesh or embedded object to take at the first goal
  std::string style = "auto";          ///< of the grasp
  std::optional<double> object_yaw_deg;
  double sigma = 1.0;
  bool all = false;  ///< keep every sample
  bool write_report = true;
  std::string output = "reach";

  std::string Method() const {
    return !method.empty() ? method : object.empty() ? "intention" : "latent-opt";
  }
};

/// "X,Y,Z" of an option: three finite numbers. Throws Error naming what is wrong.
Eigen::Vector3d ParsePoint(const std::string& option, const std::string& text);

/// "clip.npz:40" as a clip and its frame; without a number the frame is empty (the last). A file
/// whose name is all of the text is that file.
std::pair<std::string, std::optional<int>> ParseStart(const std::string& text);

/// Makes the motions, chooses one, and writes the result folder: clip.npz, metrics.json,
/// report.html, and with `all` samples/NN.npz. Throws FitFailure when the network's numbers break
/// in every sample.
Outcome RunReachJob(const ReachJob& job, const CommonOptions& common);

}  // namespace holdfast::apps
