#!/usr/bin/env bash
# Two sheets to look at: 54 fits (18 objects in three clips) and 32 synthesized clips. Goes on
# where it was stopped; about 15 minutes of one core.
#
#   tests/evaluation/sheets.sh [FOLDER]     # out/sheets: fits.png, synthesized.png
#
# Environment: HOLDFAST (the program, default build/release/apps/holdfast), HOLDFAST_DATA (default ../shared/data).
set -euo pipefail
cd "$(dirname "$0")/../.."
out=${1:-out/sheets}
holdfast=${HOLDFAST:-build/release/apps/holdfast}
data=$(realpath "${HOLDFAST_DATA:-../shared/data}")
clips=(demo_inspect "$data/mocap/sb_reach/ChrHarmony_Relax001_ArmReachRtMidLow.bvh.gz"
  "$data/mocap/sb_gesture/ChrConnor_IdleStand01_BeatFlipRt01.bvh.gz")
objects=(apple banana bottle bowl camera cube cylinder flashlight fryingpan hammer knife lightbulb mug phone
  sphere teapot toothbrush wineglass)
intents=("drink mug" "drink wineglass" "drink bottle" "eat apple" "eat banana" "pass mug" "pass apple"
  "inspect camera" "inspect cube" "lift bowl" "lift teapot" "call phone" "takepicture camera" "brush toothbrush"
  "toast wineglass" "pour bottle" "pour teapot" "offhand apple" "offhand hammer" "shake bottle"
  "switchON flashlight" "switchON lightbulb" "use hammer" "use knife" "chop knife" "cook fryingpan" "use phone"
  "inspect sphere" "lift cylinder" "inspect mug" "pass knife" "toast mug")
mkdir -p "$out/pictures"

# Pictures of one size, in rows.
tile() { # columns output pictures...
  local columns=$1 output=$2 k=0
  shift 2
  mkdir -p "$out/tiles" && rm -f "$out"/tiles/*
  for picture in "$@"; do
    cp "$picture" "$out/tiles/$(printf '%03d' "$k").png"
    k=$((k + 1))
  done
  ffmpeg -loglevel error -y -i "$out/tiles/%03d.png" -filter_complex \
    "tile=${columns}x$(((k + columns - 1) / columns)),split[a][b];[a]palettegen[p];[b][p]paletteuse=dither=none" \
    -frames:v 1 "$output"
}

for object in "${objects[@]}"; do
  for clip in "${clips[@]}"; do echo "$clip $object hand=right"; done
done >"$out/fits.txt"
"$holdfast" fit --batch "$out/fits.txt" -o "$out/fits" --quiet >/dev/null || true # exit code 3: some fits have faults
pictures=()
for object in "${objects[@]}"; do
  for clip in "${clips[@]}"; do
    name=$(basename "$clip" .bvh.gz)_$object
    [ -e "$out/fits/$name/clip.npz" ] || continue
    picture=$out/pictures/$name.png
    if [ ! -e "$picture" ]; then # the middle frame
      "$holdfast" render "$out/fits/$name" -o "$out/three.png" --sheet 3x1 --camera hand --size 170x170 --quiet --force >/dev/null
      ffmpeg -loglevel error -y -i "$out/three.png" -vf "crop=iw/3:ih:iw/3:0" "$picture"
    fi
    pictures+=("$picture")
  done
done
tile 9 "$out/fits.png" "${pictures[@]}"

pictures=()
for k in "${!intents[@]}"; do
  read -r action object <<<"${intents[$k]}"
  folder=$out/synthesized/${action}_$object
  [ -e "$folder/clip.npz" ] ||
    "$holdfast" synthesize --action "$action" --object "$object" --seed $((k % 5 + 2)) -o "$folder" --no-report --quiet >/dev/null || true
  [ -e "$folder/clip.npz" ] || continue
  picture=$out/pictures/${action}_$object.png
  [ -e "$picture" ] || "$holdfast" render "$folder" -o "$picture" --sheet 6x1 --size 110x170 --camera front --quiet >/dev/null
  pictures+=("$picture")
done
tile 2 "$out/synthesized.png" "${pictures[@]}"
