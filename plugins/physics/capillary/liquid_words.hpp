// The words of `fix ID all capillary/liquid ...`: the same in all engines that have this command.
#pragma once

#include <string>
#include <vector>

#include "../keyword_reader.hpp"
#include "../normal_force.hpp"
#include "liquid_ledger.hpp"

namespace dembark::capillary {

/// What a grain owns at the beginning.
struct GrainContent {
  double content = 0.0;  ///< liquid volume over grain volume
  double volume = -1.0;  ///< m^3 a grain, in place of it if >= 0

  double of(double radius) const { return volume >= 0.0 ? volume : content * (4.0 / 3.0) * pi * radius * radius * radius; }
};

/// Rules and walls to the ledger. `wall_style`: the engine's style of walls, for messages. Throws std::invalid_argument with one line.
inline GrainContent read_liquid(const std::vector<std::string>& words, const std::string& wall_style, LiquidLedger& ledger) {
  using keywords::refuse;
  keywords::Reader in(words);
  GrainContent grains;
  const auto name = [&in] { return in.left() ? in.word("", "") : std::string(); };
  while (in.left()) {
    const std::string word = name();
    if (word == "content" || word == "volume") {
      if (grains.content > 0.0 || grains.volume >= 0.0) refuse("the liquid of a grain is given once: either content or volume");
      double& value = word == "content" ? grains.content : grains.volume;
      value = in.number(word, "the value");
      if (!(value >= 0.0)) refuse(word + (word == "content" ? " (liquid volume over grain volume)" : " (m^3 a grain)") + " must be >= 0");
    } else if (word == "share") {
      if (!ledger.share.set_kind(name())) refuse("share must be followed by " + names_text(share_names()));
      ledger.share.factor = in.number(word, "the factor");
      if (const char* const wrong = ledger.share.error()) refuse(wrong);
    } else if (word == "return") {
      if (!option_from_name(return_names(), name(), ledger.split)) refuse("return must be followed by " + names_text(return_names()));
    } else if (word == "max_bridge") {
      ledger.largest_bridge = in.number(word, "the value");
      if (!(ledger.largest_bridge > 0.0)) refuse("max_bridge (m^3) must be > 0");
    } else if (word == "wall") {
      if (in.count_left() < 4)
        refuse("wall must be followed by the ID of a " + wall_style + ", its liquid (m^3), the share it gives and the part it gets back");
      LiquidWall wall;
      wall.name = name();
      if (ledger.wall(wall.name)) refuse("wall " + wall.name + " is given twice");
      wall.pool = in.number("wall " + wall.name, "its liquid");
      wall.share = in.number("wall " + wall.name, "its share");
      wall.part = in.number("wall " + wall.name, "its part");
      if (const char* const wrong = wall.error()) refuse("wall " + wall.name + ": " + wrong);
      ledger.walls.push_back(wall);
    } else refuse("keyword '" + word + "' is unknown; there are content, volume, share, return, max_bridge, wall");
  }
  return grains;
}

/// After a restart the walls are those of the file, with what they held. What the words say of a wall, but for its liquid, holds.
inline void restore_liquid(LiquidLedger& ledger, const std::string& saved) {
  const std::vector<LiquidWall> given = ledger.walls;
  ledger.restore(saved);
  for (LiquidWall& wall : ledger.walls) wall.share = wall.part = 0.0;
  for (const LiquidWall& wall : given) {
    LiquidWall* const same = ledger.wall(wall.name);
    if (!same) {
      ledger.walls.push_back(wall);
      continue;
    }
    same->share = wall.share;
    same->part = wall.part;
  }
}

}  // namespace dembark::capillary
