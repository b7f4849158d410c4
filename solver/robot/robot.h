// SPDX-License-Identifier: MIT
#pragma once

/// Robot hands: a clip of a human hand with an object and a robot's URDF or MJCF go in; the robot's
/// wrist and joints, frame by frame, with the contacts kept, come out.

#include "solver/robot/robot_measures.h"
#include "solver/robot/robot_output.h"
#include "solver/robot/transfer_to_robot.h"
#include "solver/robot_hand/robot_hand.h"
