// SPDX-License-Identifier: MIT
#include "solver/grasp/wrench_program.h"

#include <algorithm>
#include <array>

#ifndef HOLDFAST_WITHOUT_GPL
#include <glpk.h>
#else
#include <lpsolve/lp_lib.h>
#endif

namespace holdfast {
namespace {

constexpr int kSumRow = 7, kMissing = 12;  // number of columns for slacks

using Vector6d = WrenchProgram::Vector6d;

// Coefficients of a column in the rows 1 to 7; entry 0 is its cost.
using Column = std::array<double, 8>;

Column SlackColumn(int k, double cost) {
  Column column = {cost};
  column[1 + k / 2] = k % 2 ? 1.0 : -1.0;
  return column;
}

Column ForceColumn(const Vector6d& wrench, double cost) {
  Column column = {cost};
  for (int k = 0; k < 6; ++k) column[1 + k] = wrench(k);
  column[kSumRow] = 1.0;
  return column;
}

}  // namespace

#ifndef HOLDFAST_WITHOUT_GPL

namespace {

// GLPK keeps an environment for each thread that uses it.
struct FreeEnvironment {
  ~FreeEnvironment() { glp_free_env(); }
};

}  // namespace

struct WrenchProgram::Program {
  explicit Program(double force_cost) : forces(force_cost) {
    thread_local const FreeEnvironment at_the_end_of_the_thread;
    (void)at_the_end_of_the_thread;
    glp_term_out(GLP_OFF);
    lp.reset(glp_create_prob());
    glp_add_rows(lp.get(), kSumRow);
    glp_set_row_bnds(lp.get(), kSumRow, GLP_FR, 0.0, 0.0);
  }
  void Add(const Column& column) {
    const int j = glp_add_cols(lp.get(), 1);
    Set(j, column);
    glp_set_col_bnds(lp.get(), j, GLP_LO, 0.0, 0.0);
    glp_set_obj_coef(lp.get(), j, column[0]);
  }
  void Set(int j, const Column& column) {
    constexpr std::array<int, 8> kRows = {0, 1, 2, 3, 4, 5, 6, 7};
    glp_set_mat_col(lp.get(), j, kSumRow, kRows.data(), column.data());
  }
  void SetLoad(int row, double load) { glp_set_row_bnds(lp.get(), row, GLP_FX, load, load); }
  void SetMostSum(double most) { glp_set_row_bnds(lp.get(), kSumRow, GLP_UP, 0.0, most); }
  bool Minimize() {
    glp_smcp options;
    glp_init_smcp(&options);
    options.msg_lev = GLP_MSG_OFF;
    options.meth = GLP_DUALP;  // dual if the last basis is dual feasible, else primal
    if (glp_simplex(lp.get(), &options) == 0) return true;
    glp_std_basis(lp.get());
    return glp_simplex(lp.get(), &options) == 0;
  }
  double Amount(int j) const { return glp_get_col_prim(lp.get(), j); }
  double Multiplier(int row) const { return glp_get_row_dual(lp.get(), row); }

  double forces;
  std::unique_ptr<glp_prob, decltype(&glp_delete_prob)> lp{nullptr, glp_delete_prob};
};

#else

struct WrenchProgram::Program {
  explicit Program(double force_cost) : forces(force_cost), lp(make_lp(kSumRow, 0), delete_lp) {
    set_verbose(lp.get(), NEUTRAL);
    for (int row = 1; row < kSumRow; ++row) set_constr_type(lp.get(), row, EQ);
    set_constr_type(lp.get(), kSumRow, LE);
    set_rh(lp.get(), kSumRow, get_infinite(lp.get()));
    set_presolve(lp.get(), PRESOLVE_SENSDUALS, 0);  // it keeps the multipliers
    set_scaling(lp.get(), SCALE_NONE);
    set_epslevel(lp.get(), EPS_TIGHT);
  }
  void Add(Column column) { add_column(lp.get(), column.data()); }
  void Set(int j, Column column) { set_column(lp.get(), j, column.data()); }
  void SetLoad(int row, double load) { set_rh(lp.get(), row, load); }
  void SetMostSum(double most) { set_rh(lp.get(), kSumRow, most); }
  bool Minimize() {
    if (solve(lp.get()) == OPTIMAL) return true;
    default_basis(lp.get());
    return solve(lp.get()) == OPTIMAL;
  }
  double Amount(int j) const {
    double* amounts = nullptr;
    get_ptr_variables(lp.get(), &amounts);
    return amounts[j - 1];
  }
  double Multiplier(int row) const {
    double* multipliers = nullptr;
    get_ptr_dual_solution(lp.get(), &multipliers);
    return multipliers[row];
  }

  double forces;
  std::unique_ptr<lprec, decltype(&delete_lp)> lp;
};

#endif

WrenchProgram::WrenchProgram(double forces, double missing)
    : program_(std::make_unique<Program>(forces)) {
  for (int k = 0; k < kMissing; ++k) program_->Add(SlackColumn(k, missing));
}

WrenchProgram::~WrenchProgram() = default;

void WrenchProgram::Set(const Wrenches& wrenches) {
  for (Eigen::Index i = 0; i < wrenches.cols(); ++i) {
    if (i >= std::ssize(wrenches_)) {
      Add(wrenches.col(i));
      continue;
    }
    wrenches_[i] = wrenches.col(i);
    program_->Set(1 + kMissing + static_cast<int>(i), ForceColumn(wrenches_[i], program_->forces));
  }
}

void WrenchProgram::Add(const Vector6d& wrench) {
  wrenches_.push_back(wrench);
  program_->Add(ForceColumn(wrench, program_->forces));
}

void WrenchProgram::SetLoad(const Vector6d& load) {
  for (int k = 0; k < 6; ++k) program_->SetLoad(1 + k, load(k));
}

void WrenchProgram::SetMostSum(double most) { program_->SetMostSum(most); }

std::pair<Vector6d, double> WrenchProgram::Minimize() {
  std::pair<Vector6d, double> reached{Vector6d::Zero(), 0.0};
  if (!program_->Minimize()) return reached;
  for (std::size_t i = 0; i < wrenches_.size(); ++i) {
    const double x = std::max(0.0, program_->Amount(1 + kMissing + static_cast<int>(i)));
    reached.first += x * wrenches_[i];
    reached.second += x;
  }
  return reached;
}

Vector6d WrenchProgram::Direction() const {
  Vector6d direction;
  for (int k = 0; k < 6; ++k) direction(k) = program_->Multiplier(1 + k);
  return direction;
}

}  // namespace holdfast
