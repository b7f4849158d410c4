// SPDX-License-Identifier: MIT
#include "python/src/custom_term.h"

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

#include <ceres/dynamic_numeric_diff_cost_function.h>

#include <fmt/format.h>

namespace holdfast::python {
namespace {

using namespace py::literals;

// Terms are copied and destroyed by threads that do not hold the interpreter lock.
using SharedObject = std::shared_ptr<const py::object>;
SharedObject Share(py::object object) {
  return {new py::object(std::move(object)), [](const py::object* kept) {
            const py::gil_scoped_acquire locked;
            delete kept;
          }};
}

// Cost function from a callable: function(frame, *blocks) returns residuals, or residuals and a
// list of their Jacobians per block. Without Jacobians, Ceres differentiates numerically.
class CallableCost final : public ceres::CostFunction {
 public:
  CallableCost(SharedObject function, int frame, int num_residuals, std::vector<int> sizes)
      : function_(std::move(function)), frame_(frame) {
    set_num_residuals(num_residuals);
    *mutable_parameter_block_sizes() = std::move(sizes);
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    if (Call(parameters, residuals, jacobians) || jacobians == nullptr) return true;
    if (numeric_ == nullptr) {
      numeric_ = std::make_unique<Numeric>(new Values{this});
      for (const int size : parameter_block_sizes()) numeric_->AddParameterBlock(size);
      numeric_->SetNumResiduals(num_residuals());
    }
    return numeric_->Evaluate(parameters, residuals, jacobians);
  }

 private:
  struct Values {
    const CallableCost* cost;
    bool operator()(double const* const* parameters, double* residuals) const {
      cost->Call(parameters, residuals, nullptr);
      return true;
    }
  };
  using Numeric = ceres::DynamicNumericDiffCostFunction<Values, ceres::CENTRAL>;

  // Returns whether the function gave Jacobians. Rethrows its exceptions as text.
  bool Call(double const* const* parameters, double* residuals, double** jacobians) const {
    const py::gil_scoped_acquire locked;
    try {
      const std::vector<int>& sizes = parameter_block_sizes();
      py::tuple arguments(1 + sizes.size());
      arguments[0] = frame_;
      for (std::size_t b = 0; b < sizes.size(); ++b) {
        arguments[1 + b] = py::array_t<double>(sizes[b], parameters[b]);
      }
      const py::object answer = (*function_)(*arguments);
      const bool both = py::isinstance<py::tuple>(answer);
      if (both && py::len(answer) != 2) {
        throw std::runtime_error(fmt::format(
            "expected residuals, or (residuals, [a Jacobian of each block]), got a tuple of {}",
            py::len(answer)));
      }
      Copy(both ? py::object(answer[py::int_(0)]) : answer, "residuals", {num_residuals()},
           residuals);
      if (!both || jacobians == nullptr) return both;
      const py::object list = answer[py::int_(1)];
      if (py::len(list) != sizes.size()) {
        throw std::runtime_error(fmt::format("expected {} Jacobians, one of each block, got {}",
                                             sizes.size(), py::len(list)));
      }
      for (std::size_t b = 0; b < sizes.size(); ++b) {
        if (jacobians[b] == nullptr) continue;
        Copy(list[py::int_(b)], "Jacobian", {num_residuals(), sizes[b]}, jacobians[b]);
      }
      return true;
    } catch (const py::error_already_set& error) {
      throw std::runtime_error(error.what());  // while the lock is held
    }
  }

  // Copies numbers unchecked: the solver checks whether they are finite.
  static void Copy(const py::object& value, const char* name, const Shape& shape, double* to) {
    const auto array =
        py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(value);
    if (!array) throw py::error_already_set();
    const Shape got(array.shape(), array.shape() + array.ndim());
    if (got != shape) {
      throw std::runtime_error(fmt::format("{} of shape ({}), expected ({})", name,
                                           fmt::join(got, ", "), fmt::join(shape, ", ")));
    }
    std::copy_n(array.data(), array.size(), to);
  }

  SharedObject function_;
  int frame_;
  mutable std::unique_ptr<Numeric> numeric_;
};

CustomTerm MakeTerm(const std::string& name, const std::vector<std::string>& blocks,
                    const py::function& function, int num_residuals, double weight) {
  CustomTerm term{name, weight, {}, {}};
  std::vector<int> sizes;
  for (const std::string& block : blocks) {
    const auto known = FitBlocks();
    const auto found =
        std::ranges::find_if(known, [&](const FitBlockInfo& info) { return block == info.name; });
    if (found == known.end()) {
      std::vector<std::string> names;
      for (const FitBlockInfo& info : known) names.emplace_back(info.name);
      throw py::value_error(
          fmt::format("blocks: none is called '{}'. There are: {}", block, fmt::join(names, ", ")));
    }
    term.blocks.push_back(found->block);
    sizes.push_back(found->size);
  }
  if (num_residuals < 1) throw py::value_error("num_residuals: expected 1 or more");
  term.make = [shared = Share(function), num_residuals, sizes](const CustomTermFrame& frame) {
    return std::make_unique<CallableCost>(shared, frame.frame, num_residuals, sizes);
  };
  CheckCustomTerms({&term, 1});
  return term;
}

std::string BlocksText() {
  std::vector<std::string> lines;
  for (const FitBlockInfo& info : FitBlocks()) {
    lines.push_back(fmt::format("'{}' ({},)", info.name, info.size));
  }
  return fmt::format("{}", fmt::join(lines, ", "));
}

}  // namespace

std::vector<CustomTerm> CustomTermsOf(const py::object& terms) {
  std::vector<CustomTerm> list;
  if (terms.is_none()) return list;
  for (const py::handle& term : terms) {
    if (!py::isinstance<CustomTerm>(term)) {
      throw py::type_error("custom_terms: expected a list of CustomTerm, got " + TypeText(term));
    }
    list.push_back(term.cast<CustomTerm>());
  }
  CheckCustomTerms(list);
  return list;
}

void BindCustomTerm(py::module_& module) {
  const std::string doc = fmt::format(
      R"(A user-defined term of the problem that Ceres solves for each frame of a fit.

If the function raises, or returns a wrong shape or a non-finite number at the initial values of a
frame, the frame keeps its initial values, and 'warnings' of the result names the term and the
frame.

Parameters
----------
name : str
    Letters, digits and underscores. The energy is the column energy_NAME of per_frame (None in
    frames without it).
blocks : list of str
    Parameter blocks that the term depends on:
    {}.
    Rotations are unit quaternions (x, y, z, w), object to world. Translations are in meters,
    fingers axis-angle in radians. Wrist blocks are offsets from the clip's wrist, and move where
    two hands hold.
function : callable
    function(frame, *blocks) takes the frame's number and copies of the blocks. It returns residuals
    (num_residuals,), or a tuple (residuals, [Jacobian (num_residuals, size) of each block]).
    Without Jacobians, Ceres differentiates numerically.
num_residuals : int
weight : float, default 1.0
    Weight of the sum of squares.

Examples
--------
>>> def upright(frame, q):
...     x, y, z, w = q
...     return np.array([2 * (x * z + w * y), 2 * (y * z - w * x)])  # z axis: vertical
>>> term = holdfast.CustomTerm('upright', ['object_rotation'], upright, 2, weight=1e4)
>>> held = holdfast.fit('demo_drink', 'mug', custom_terms=[term])
)",
      BlocksText());
  py::class_<CustomTerm>(module, "CustomTerm", doc.c_str())
      .def(py::init(&MakeTerm), "name"_a, "blocks"_a, "function"_a, "num_residuals"_a,
           py::kw_only(), "weight"_a = 1.0)
      .def_readonly("name", &CustomTerm::name)
      .def_readwrite("weight", &CustomTerm::weight, "of the sum of squares; lambda of E_d is 1")
      .def("__repr__", [](const CustomTerm& term) {
        return fmt::format("<holdfast.CustomTerm: {}, weight {:g}>", term.name, term.weight);
      });
}

}  // namespace holdfast::python
