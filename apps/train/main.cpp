// SPDX-License-Identifier: MIT
#include <cstdio>
#include <exception>

#include <fmt/format.h>

#include "apps/common.h"
#include "apps/interrupt.h"
#include "apps/train/train_wandr.h"
#include "geometry/error.h"

// A program of its own, which `holdfast train` runs: LibTorch takes longer to load than most of
// holdfast's commands take.
int main(int argc, char** argv) {
  using namespace holdfast::apps;
  CLI::App app{"holdfast train: trains the networks that holdfast runs", "holdfast train"};
  app.require_subcommand(1);
  int exit_code = kDone;
  AddTrainWandrCommand(app, exit_code);
  WatchForInterrupt();
  try {
    app.parse(argc, argv);
    return exit_code;
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kDone : kUsageFault;
  } catch (const std::exception& error) {
    fmt::print(stderr, "holdfast train: {}\n", error.what());
  }
  return kInputFault;
}
