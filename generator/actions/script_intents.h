// SPDX-License-Identifier: MIT
#pragma once

#include "generator/actions/script_writer.h"

namespace holdfast {

// One function per intent: the keys after the start, drawn. At the face (script_face.cpp):
void WriteDrink(ScriptWriter& writer);
void WriteToast(ScriptWriter& writer);
void WriteEat(ScriptWriter& writer);
void WriteCall(ScriptWriter& writer);
void WriteTakePicture(ScriptWriter& writer);
void WriteBrush(ScriptWriter& writer);
// Before the body (script_front.cpp):
void WritePass(ScriptWriter& writer);
void WriteInspect(ScriptWriter& writer);
void WriteLift(ScriptWriter& writer);
void WritePour(ScriptWriter& writer);
void WriteOffhand(ScriptWriter& writer);
// With tools (script_tools.cpp):
void WriteShake(ScriptWriter& writer);
void WriteSwitchOn(ScriptWriter& writer);
void WriteHammer(ScriptWriter& writer);
void WriteChop(ScriptWriter& writer);
void WriteCook(ScriptWriter& writer);

}  // namespace holdfast
