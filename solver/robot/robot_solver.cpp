// SPDX-License-Identifier: MIT
#include "solver/robot/robot_solver.h"

namespace holdfast {

RobotSolver::RobotSolver(const RobotHand& hand) : hand_(hand), robot_(hand), normal_(hand) {
  pose_.q.resize(hand.NumDofs());
}

std::vector<int> RobotSolver::TangentSizes() const { return {3, 3, hand_.NumDofs()}; }

void RobotSolver::Set(double const* const* parameters) const {
  pose_.R = Eigen::Map<const Eigen::Quaterniond>(parameters[0]).toRotationMatrix();
  pose_.T = Eigen::Map<const Eigen::Vector3d>(parameters[1]);
  pose_.q = Eigen::Map<const Eigen::VectorXd>(parameters[2], hand_.NumDofs());
  robot_.Set(pose_);
}

double RobotSolver::CostAt(double const* const* parameters) const {
  Set(parameters);
  double cost = 0.0;
  for (const RobotTerm* term : *terms_) cost += term->Add(robot_, nullptr);
  return cost;
}

void RobotSolver::NormalEquations(double const* const* parameters,
                                  Eigen::Ref<Eigen::MatrixXd> hessian,
                                  Eigen::Ref<Eigen::VectorXd> gradient) const {
  Set(parameters);
  normal_.Begin(robot_);
  for (const RobotTerm* term : *terms_) term->Add(robot_, &normal_);
  normal_.Finish(hessian, gradient);
}

DenseMinimizer::Report RobotSolver::Solve(const std::vector<const RobotTerm*>& terms,
                                          const DenseMinimizer::Options& options, RobotPose& pose) {
  terms_ = &terms;
  Eigen::Quaterniond turn(pose.R);
  Eigen::Vector3d T = pose.T;
  Eigen::VectorXd q = pose.q;
  DenseMinimizer minimizer;
  minimizer.AddBlock(turn.coeffs().data(), 4, true);
  minimizer.AddBlock(T.data(), 3);
  minimizer.AddBlock(q.data(), hand_.NumDofs());
  minimizer.AddTerm(static_cast<const NormalTerm&>(*this),
                    {turn.coeffs().data(), T.data(), q.data()});
  const DenseMinimizer::Report report = minimizer.Minimize(options);
  pose = {turn.toRotationMatrix(), T, hand_.Clamped(q)};
  return report;
}

double RobotSolver::Evaluate(const std::vector<const RobotTerm*>& terms, const RobotPose& pose,
                             Eigen::MatrixXd& hessian, Eigen::VectorXd& gradient) {
  const Eigen::Index n = 6 + hand_.NumDofs();
  hessian.resize(n, n);
  gradient.resize(n);
  robot_.Set(pose);
  normal_.Begin(robot_);
  double cost = 0.0;
  for (const RobotTerm* term : terms) cost += term->Add(robot_, &normal_);
  normal_.Finish(hessian, gradient);
  return cost;
}

}  // namespace holdfast
