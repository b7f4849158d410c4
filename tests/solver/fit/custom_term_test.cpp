// SPDX-License-Identifier: MIT
#include "solver/fit/custom_term.h"

#include <cmath>
#include <limits>
#include <stdexcept>

#include <ceres/sized_cost_function.h>

#include <gtest/gtest.h>

#include "geometry/error.h"
#include "solver/fit/fit.h"
#include "tests/support/hand_scene.h"

namespace holdfast {
namespace {

using testing::HandScene;

// The object's place is wanted at the given one, meters.
class AtPlace final : public ceres::SizedCostFunction<3, 3> {
 public:
  explicit AtPlace(Eigen::Vector3d place) : place_(std::move(place)) {}
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    Eigen::Map<Eigen::Vector3d> r(residuals);
    r = Eigen::Map<const Eigen::Vector3d>(parameters[0]) - place_;
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> J(jacobians[0]);
      J.setIdentity();
    }
    return true;
  }

 private:
  Eigen::Vector3d place_;
};

// Does what a test asks for in place of an evaluation.
class Doing final : public ceres::CostFunction {
 public:
  Doing(int size, std::function<bool(double*)> act) : act_(std::move(act)) {
    set_num_residuals(1);
    mutable_parameter_block_sizes()->push_back(size);
  }
  bool Evaluate(double const* const*, double* residuals, double** jacobians) const override {
    residuals[0] = 0.0;
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      std::fill_n(jacobians[0], parameter_block_sizes()[0], 0.0);
    }
    return act_(residuals);
  }

 private:
  std::function<bool(double*)> act_;
};

// A hand that holds an object through three equal frames.
struct CustomTermTest : ::testing::Test {
  CustomTermTest() {
    clip.frame_rate = 30.0;
    clip.pose.assign(3, scene.pose);
    clip.trans = scene.trans.replicate(1, 3);
    clip.object.emplace();
    clip.object->orient = LogSO3(scene.object_pose.orientation.toRotationMatrix()).replicate(1, 3);
    clip.object->trans = scene.object_pose.translation.replicate(1, 3);
  }
  FitResult Fit(CustomTerm term) {
    FitOptions options;
    options.custom_terms = {std::move(term)};
    FitObject object;
    object.vertices = scene.object;
    const HandModel* const hands[] = {&scene.hand};
    const std::vector<std::uint8_t> holding(3, HoldingBit(scene.hand.HandSide()));
    FitOptions paper = options.OnlyPaper();
    return FitClip(clip, hands, object, holding, paper);
  }
  CustomTerm Term(std::function<std::unique_ptr<ceres::CostFunction>(int)> make) {
    CustomTerm term;
    term.name = "own";
    term.weight = 1e6;
    term.blocks = {FitBlock::kObjectTranslation};
    term.make = [make = std::move(make)](const CustomTermFrame& frame) {
      return make(frame.frame);
    };
    return term;
  }

  HandScene scene;
  Clip clip;
};

TEST_F(CustomTermTest, IsMinimizedWithTheOthersAndReported) {
  const Eigen::Vector3d place = scene.object_pose.translation + Eigen::Vector3d(0.0, 0.0, 0.02);
  const FitResult still = Fit(Term([](int) { return nullptr; }));
  EXPECT_TRUE(std::isnan(still.frames[1].custom_energies.at(0)));
  EXPECT_LT((still.clip.object->trans.col(2) - scene.object_pose.translation).norm(), 1e-4);
  const FitResult moved =
      Fit(Term([&](int frame) { return frame == 2 ? std::make_unique<AtPlace>(place) : nullptr; }));
  EXPECT_TRUE(std::isnan(moved.frames[0].custom_energies.at(0)));
  EXPECT_TRUE(std::isnan(moved.frames[1].custom_energies.at(0)));
  const double off = (moved.clip.object->trans.col(2) - place).norm();
  EXPECT_LT(off, 0.01);
  EXPECT_NEAR(moved.frames[2].custom_energies.at(0), off * off, 1e-9);
  EXPECT_NEAR(moved.frames[2].energy_total,
              moved.frames[2].energies.Total(FitOptions().OnlyPaper()) + 1e6 * off * off, 1e-3);
}

TEST_F(CustomTermTest, WhatItDoesWrongIsSaidAndTheFrameKeepsItsStart) {
  struct Case {
    std::unique_ptr<ceres::CostFunction> (*make)();
    const char* said;
  };
  const Case cases[] = {
      {[]() -> std::unique_ptr<ceres::CostFunction> {
         return std::make_unique<Doing>(3, [](double*) { return false; });
       },
       "custom term 'own' returned false"},
      {[]() -> std::unique_ptr<ceres::CostFunction> {
         return std::make_unique<Doing>(3, [](double* r) {
           r[0] = std::numeric_limits<double>::quiet_NaN();
           return true;
         });
       },
       "custom term 'own' returned nan as residual 0"},
      {[]() -> std::unique_ptr<ceres::CostFunction> {
         return std::make_unique<Doing>(
             3, [](double*) -> bool { throw std::runtime_error("no such file"); });
       },
       "custom term 'own' threw: no such file"},
      {[]() -> std::unique_ptr<ceres::CostFunction> {
         return std::make_unique<Doing>(4, [](double*) { return true; });
       },
       "custom term 'own' expects 4 numbers of object_translation, which has 3"},
      {[]() -> std::unique_ptr<ceres::CostFunction> { throw std::runtime_error("not today"); },
       "custom term 'own' threw: not today"},
  };
  for (const Case& wrong : cases) {
    const FitResult result = Fit(Term([&](int frame) {
      return frame == 1 ? wrong.make() : std::unique_ptr<ceres::CostFunction>();
    }));
    ASSERT_EQ(result.frames.size(), 3u);
    EXPECT_EQ(result.frames[1].stop, StopReason::kFailed) << wrong.said;
    EXPECT_EQ(result.frames[1].fault, wrong.said);
    EXPECT_LT((result.clip.object->trans.col(1) - scene.object_pose.translation).norm(), 1e-9);
    EXPECT_EQ(result.frames[2].stop, StopReason::kConverged);
    EXPECT_EQ(result.frames[2].fault, "");
  }
}

TEST_F(CustomTermTest, TermsThatCannotBeAreRefused) {
  const auto good = Term([](int) { return nullptr; });
  EXPECT_NO_THROW(CheckCustomTerms({&good, 1}));
  const auto refused = [&](auto&& spoil) {
    CustomTerm term = good;
    spoil(term);
    EXPECT_THROW(CheckCustomTerms({&term, 1}), Error);
  };
  refused([](CustomTerm& term) { term.name = "two words"; });
  refused([](CustomTerm& term) { term.name = "contact"; });
  refused([](CustomTerm& term) { term.weight = 0.0; });
  refused([](CustomTerm& term) { term.weight = std::numeric_limits<double>::infinity(); });
  refused([](CustomTerm& term) { term.blocks.clear(); });
  refused([](CustomTerm& term) { term.make = nullptr; });
  const CustomTerm twice[] = {good, good};
  EXPECT_THROW(CheckCustomTerms(twice), Error);
}

}  // namespace
}  // namespace holdfast
