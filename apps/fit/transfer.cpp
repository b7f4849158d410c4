// SPDX-License-Identifier: MIT
#include "apps/fit/transfer_robot.h"

namespace holdfast::apps {
namespace {

struct TransferCommand {
  CommonOptions common;
  ClipInputOptions input;
  RobotTransferInput robot;
  std::string clip;
  std::string output;
};

}  // namespace

void AddTransferCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<TransferCommand>();
  CLI::App* command =
      app.add_subcommand("transfer", "Transfer a clip of a hand and an object to a robot's hand");
  command->add_option("clip", options->clip, kClipHelp)->required();
  command->add_option("-o,--output", options->output, "Folder to make")->required();
  AddOption(*command, "--hand", options->robot.hand, "The hand that is transferred",
            CLI::IsMember({"auto", "right", "left"}));
  AddRobotOptions(*command, options->robot);
  command->get_option("--robot")->required();
  AddClipInputOptions(*command, options->input);
  AddCommonOptions(*command, options->common, true,
                   "  holdfast transfer held --robot allegro_hand_right.urdf -o robot\n"
                   "  holdfast transfer demo_drink --robot hand.xml --robot-on-path -o robot "
                   "--json\n");
  command->callback([options, &exit_code] {
    exit_code = RunRobotTransfer(options->clip, options->input, options->robot, options->output,
                                 options->common);
  });
}

}  // namespace holdfast::apps
