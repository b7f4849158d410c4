// SPDX-License-Identifier: MIT
#include "solver/fit/custom_term.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <exception>
#include <limits>

#include <fmt/format.h>

#include "geometry/error.h"
#include "solver/fit/fit_options.h"

namespace holdfast {
namespace {

constexpr FitBlockInfo kBlocks[] = {
    {FitBlock::kObjectRotation, "object_rotation", 4},
    {FitBlock::kObjectTranslation, "object_translation", 3},
    {FitBlock::kRightFingers, "right_fingers", kHandDofs},
    {FitBlock::kLeftFingers, "left_fingers", kHandDofs},
    {FitBlock::kRightWristRotation, "right_wrist_rotation", 4},
    {FitBlock::kRightWristTranslation, "right_wrist_translation", 3},
    {FitBlock::kLeftWristRotation, "left_wrist_rotation", 4},
    {FitBlock::kLeftWristTranslation, "left_wrist_translation", 3},
};

const FitBlockInfo& InfoOf(FitBlock block) { return kBlocks[static_cast<std::size_t>(block)]; }

// Describes the error in the sizes of a cost function; empty if there is none.
std::string FaultOfSizes(const CustomTerm& term, const ceres::CostFunction& cost) {
  const std::vector<int>& sizes = cost.parameter_block_sizes();
  if (sizes.size() != term.blocks.size()) {
    return fmt::format("has {} parameter blocks, and {} were named", sizes.size(),
                       term.blocks.size());
  }
  for (std::size_t k = 0; k < sizes.size(); ++k) {
    const FitBlockInfo& info = InfoOf(term.blocks[k]);
    if (sizes[k] == info.size) continue;
    return fmt::format("expects {} numbers of {}, which has {}", sizes[k], info.name, info.size);
  }
  return cost.num_residuals() > 0 ? "" : "has no residuals";
}

}  // namespace

std::span<const FitBlockInfo> FitBlocks() { return kBlocks; }

void CheckCustomTerms(std::span<const CustomTerm> terms) {
  for (const CustomTerm& term : terms) {
    const auto fail = [&](const std::string& problem, const std::string& remedy) {
      throw Error("custom term '" + term.name + "'", problem, remedy);
    };
    const bool column = !term.name.empty() && std::ranges::all_of(term.name, [](unsigned char c) {
      return std::isalnum(c) != 0 || c == '_';
    });
    if (!column) fail("has a name that cannot be a column", "Use letters, digits and underscores");
    const bool built_in = std::ranges::any_of(
        EnergyTerms(), [&](const EnergyTermInfo& info) { return term.name == info.name; });
    if (built_in || std::ranges::count(terms, term.name, &CustomTerm::name) > 1) {
      fail("has the name of another term", "Give it a name of its own");
    }
    if (!(term.weight > 0.0) || !std::isfinite(term.weight)) {
      fail(fmt::format("has the weight {}", term.weight), "Give a positive number");
    }
    if (term.blocks.empty()) fail("depends on no parameter block", "Name at least one");
    if (!term.make) fail("makes no cost function", "Set CustomTerm::make");
  }
}

GuardedTerm::GuardedTerm(const CustomTerm& term, const CustomTermFrame& frame) : term_(term) {
  try {
    cost_ = term.make(frame);
  } catch (const std::exception& error) {
    fault_ = fmt::format("threw: {}", error.what());
    return;
  }
  if (cost_ == nullptr) return;
  fault_ = FaultOfSizes(term, *cost_);
  if (!fault_.empty()) {
    cost_.reset();
    return;
  }
  set_num_residuals(cost_->num_residuals());
  *mutable_parameter_block_sizes() = cost_->parameter_block_sizes();
}

bool GuardedTerm::Evaluate(double const* const* parameters, double* residuals,
                           double** jacobians) const {
  try {
    if (!cost_->Evaluate(parameters, residuals, jacobians)) {
      fault_ = "returned false";
      return false;
    }
  } catch (const std::exception& error) {
    fault_ = fmt::format("threw: {}", error.what());
    return false;
  }
  const double scale = std::sqrt(term_.weight);
  for (int k = 0; k < num_residuals(); ++k) {
    if (!std::isfinite(residuals[k])) {
      fault_ = fmt::format("returned {} as residual {}", residuals[k], k);
      return false;
    }
    residuals[k] *= scale;
  }
  if (jacobians == nullptr) return true;
  for (std::size_t b = 0; b < term_.blocks.size(); ++b) {
    if (jacobians[b] == nullptr) continue;
    for (int k = 0; k < num_residuals() * parameter_block_sizes()[b]; ++k) {
      if (!std::isfinite(jacobians[b][k])) {
        fault_ = fmt::format("returned {} in its Jacobian by {}", jacobians[b][k],
                             InfoOf(term_.blocks[b]).name);
        return false;
      }
      jacobians[b][k] *= scale;
    }
  }
  return true;
}

double GuardedTerm::Energy(double const* const* parameters) const {
  Eigen::VectorXd residuals(num_residuals());
  if (!Acts() || !Evaluate(parameters, residuals.data(), nullptr)) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  return residuals.squaredNorm() / term_.weight;
}

}  // namespace holdfast
