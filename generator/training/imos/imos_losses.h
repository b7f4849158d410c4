// SPDX-License-Identifier: MIT
#pragma once

#include <utility>

namespace holdfast::imos {

struct LossWeights {
  double divergence = 0.001;  ///< of each encoder's latents from N(0, 1)
  double pose = 1.0;          ///< mean |6D error|
  double velocity = 1.0;      ///< mean |error of the 6D step from the key frame before|
  double joints = 2.0;        ///< mean |error| of joint coordinates, meters ...
  int num_joints = 22;        ///< ... of joints 0 .. num_joints - 1
  double wrists = 3.0;        ///< the same of the wrists, once more: hands say what is done
  double root = 1.0;          ///< mean |error of the root's step|, meters, where it is predicted
};

/// Means over rows (and time steps); not yet weighed.
struct Losses {
  double divergence = 0.0;            ///< sum over encoders
  double arms = 0.0, body = 0.0;      ///< 6D poses
  double velocity = 0.0;              ///< sum over modules
  double joints = 0.0, wrists = 0.0;  ///< meters
  double root = 0.0;                  ///< meters
  double doubt = 0.0;                 ///< of the critic: 0 none, 1 to be sure
  double critic = 0.0;                ///< share that the critic judges rightly
  double total = 0.0;                 ///< weighed
  double gradient = 0.0;              ///< norm, before it is clipped

  static constexpr std::pair<const char*, double Losses::*> kParts[] = {
      {"divergence", &Losses::divergence},
      {"arms", &Losses::arms},
      {"body", &Losses::body},
      {"velocity", &Losses::velocity},
      {"joints", &Losses::joints},
      {"wrists", &Losses::wrists},
      {"root", &Losses::root},
      {"doubt", &Losses::doubt},
      {"critic", &Losses::critic},
      {"total", &Losses::total},
      {"gradient", &Losses::gradient}};
  void Add(const Losses& other, double weight) {
    for (const auto& [name, part] : kParts) this->*part += weight * other.*part;
  }
};

}  // namespace holdfast::imos
