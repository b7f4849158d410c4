// SPDX-License-Identifier: MIT
#pragma once

#include <map>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include "generator/imos/vocabulary.h"
#include "generator/imos/weights.h"

namespace holdfast {

/// Weights of the IMoS generator, where they are from, and what they were trained on.
struct SynthesisNetwork {
  std::string source;  ///< the file, or "embedded"
  imos::NetworkWeights weights;
  std::string checksum;                        ///< tells networks apart
  Eigen::MatrixXf action_table;                ///< (29 x E)
  std::map<std::string, double> seconds;       ///< per key frame, by action, mean of the data
  std::map<std::string, nlohmann::json> seen;  ///< by action: objects and how often

  /// Actions trained on, in the vocabulary's order; all where the file does not say.
  std::vector<std::string> Actions() const;
  /// Of the action; of all, or IMoS's 0.1 s, where the file does not say.
  double SecondsPerKeyFrame(int action) const;
  nlohmann::json ToJson() const;
};

/// The weights in a file, or the embedded ones when `path` is empty; embeddings of actions from
/// `embeddings` (imos::ReadActionTable) unless that is empty. Throws Error when there are none.
SynthesisNetwork LoadSynthesisNetwork(const std::string& path = {},
                                      const std::string& embeddings = {});

}  // namespace holdfast

namespace holdfast::imos {

/// Whether this library was built with trained weights in it (meshes/networks/imos.safetensors).
bool HasDefaultNetwork();

/// Those weights. Throws Error when there are none.
NetworkWeights DefaultNetwork();

}  // namespace holdfast::imos
