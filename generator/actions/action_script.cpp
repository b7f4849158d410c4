// SPDX-License-Identifier: MIT
#include "generator/actions/action_script.h"

#include <array>

#include "generator/actions/action_catalog.h"
#include "generator/actions/script_intents.h"

namespace holdfast {
namespace {

struct Intent {
  std::string_view action;
  void (*write)(ScriptWriter&);
  double chance_of_return;  // to where the object was, at the end
};

constexpr std::array<Intent, 16> kIntents = {{{"drink", WriteDrink, 0.5},
                                              {"eat", WriteEat, 0.2},
                                              {"pass", WritePass, 0.25},
                                              {"inspect", WriteInspect, 0.35},
                                              {"lift", WriteLift, 0.7},
                                              {"call", WriteCall, 0.25},
                                              {"takepicture", WriteTakePicture, 0.35},
                                              {"brush", WriteBrush, 0.25},
                                              {"toast", WriteToast, 0.15},
                                              {"pour", WritePour, 0.5},
                                              {"offhand", WriteOffhand, 0.0},
                                              {"shake", WriteShake, 0.4},
                                              {"switchON", WriteSwitchOn, 0.3},
                                              {"use", WriteHammer, 0.3},
                                              {"chop", WriteChop, 0.3},
                                              {"cook", WriteCook, 0.3}}};

}  // namespace

ActionScript WriteScript(std::string_view action, const ActionScene& scene, RandomDraws& draws) {
  FindMadeAction(action);
  ScriptWriter writer(scene, draws);
  writer.Begin();
  double chance_of_return = 0.0;
  for (const Intent& intent : kIntents) {
    if (intent.action != action) continue;
    intent.write(writer);
    chance_of_return = intent.chance_of_return;
  }
  return writer.Finish(chance_of_return);
}

}  // namespace holdfast
