// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace holdfast {

/// An action that can be made, and what with. Action names are GRAB's; objects are the embedded
/// ones by name, the commonest first.
struct ScriptedAction {
  std::string_view name;
  std::vector<std::string_view> objects;
  double share = 1.0;  ///< of the clips of a set, relative to the others'
  std::string_view meaning;
};

std::span<const ScriptedAction> ScriptedActions();
/// Throws Error listing all, with the nearest, for a name that is none of them.
const ScriptedAction& FindScriptedAction(std::string_view name);
/// "drink, eat, ...": for help and messages.
std::string ScriptedActionNames();

}  // namespace holdfast
