// SPDX-License-Identifier: MIT
#include "generator/training/imos/imos_kinematics.h"

#include <vector>

#include "geometry/body/skeleton.h"

namespace holdfast::imos {
namespace {

constexpr double kMinNorm = 1e-9;

torch::Tensor Normalized(const torch::Tensor& v) {
  return v / torch::sqrt((v * v).sum(-1, true) + kMinNorm * kMinNorm);
}

// The joints by their distance from the pelvis: each level follows from the one before at once.
struct Levels {
  torch::Tensor order, back;  // joints level by level, and where each joint is there
  std::vector<std::int64_t> sizes;
  std::vector<torch::Tensor> parents;  // of each joint of a level, among the level before

  Levels() {
    std::vector<std::vector<std::int64_t>> joints(1, {0});
    std::vector<int> depth(kNumBodyJoints, 0), place(kNumBodyJoints, 0);
    std::vector<std::vector<std::int64_t>> above(1);
    for (int k = 1; k < kNumBodyJoints; ++k) {
      depth[k] = depth[kJointParents[k]] + 1;
      if (depth[k] == static_cast<int>(joints.size())) {
        joints.emplace_back();
        above.emplace_back();
      }
      place[k] = static_cast<int>(joints[depth[k]].size());
      joints[depth[k]].push_back(k);
      above[depth[k]].push_back(place[kJointParents[k]]);
    }
    std::vector<std::int64_t> all, inverse(kNumBodyJoints);
    for (std::size_t level = 0; level < joints.size(); ++level) {
      for (const std::int64_t joint : joints[level]) {
        inverse[joint] = static_cast<std::int64_t>(all.size());
        all.push_back(joint);
      }
      sizes.push_back(static_cast<std::int64_t>(joints[level].size()));
      parents.push_back(torch::tensor(above[level], torch::kInt64));
    }
    order = torch::tensor(all, torch::kInt64);
    back = torch::tensor(inverse, torch::kInt64);
  }
};

}  // namespace

torch::Tensor RotationsOf(const torch::Tensor& six) {
  const torch::Tensor a1 = six.narrow(-1, 0, 3), a2 = six.narrow(-1, 3, 3);
  const torch::Tensor b1 = Normalized(a1);
  const torch::Tensor b2 = Normalized(a2 - (b1 * a2).sum(-1, true) * b1);
  return torch::stack({b1, b2, torch::cross(b1, b2, -1)}, -2);
}

torch::Tensor SixOf(const torch::Tensor& rotations) {
  return rotations.narrow(-2, 0, 2).flatten(-2);
}

TorchBody ForwardJoints(const torch::Tensor& rotations, const torch::Tensor& transl,
                        const torch::Tensor& bones) {
  static const Levels levels;
  const auto by_level = [&](const torch::Tensor& x) {
    return x.index_select(1, levels.order).split_with_sizes(levels.sizes, 1);
  };
  const std::vector<torch::Tensor> turns = by_level(rotations), ways = by_level(bones);
  std::vector<torch::Tensor> world{turns[0]}, joints{transl.unsqueeze(1) + ways[0]};
  for (std::size_t k = 1; k < turns.size(); ++k) {
    const torch::Tensor above = world.back().index_select(1, levels.parents[k]);
    joints.push_back(joints.back().index_select(1, levels.parents[k]) +
                     torch::matmul(above, ways[k].unsqueeze(3)).squeeze(3));
    world.push_back(torch::matmul(above, turns[k]));
  }
  // The wrists are the last level: 20 and 21.
  return {torch::cat(joints, 1).index_select(1, levels.back), world.back()};
}

TorchObject Carried(const TorchObject& object, const TorchBody& from, const TorchBody& to,
                    const torch::Tensor& left, const torch::Tensor& right) {
  const auto by = [&](int wrist, int joint) {
    const torch::Tensor turn =
        torch::bmm(to.wrists.select(1, wrist), from.wrists.select(1, wrist).transpose(1, 2));
    const torch::Tensor arm = object.T - from.joints.select(1, joint);
    return TorchObject{torch::bmm(turn, arm.unsqueeze(2)).squeeze(2) + to.joints.select(1, joint),
                       torch::bmm(turn, object.R)};
  };
  const TorchObject in_left = by(0, WristJoint(Side::kLeft));
  const TorchObject in_right = by(1, WristJoint(Side::kRight));
  const auto choose = [&](const torch::Tensor& stays, const torch::Tensor& l,
                          const torch::Tensor& r, const std::vector<std::int64_t>& shape) {
    const torch::Tensor a = left.view(shape), b = right.view(shape);
    return stays * (1.0 - a - b) + l * a + r * b;
  };
  return {choose(object.T, in_left.T, in_right.T, {-1, 1}),
          choose(object.R, in_left.R, in_right.R, {-1, 1, 1})};
}

}  // namespace holdfast::imos
