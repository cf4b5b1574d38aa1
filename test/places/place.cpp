#include "places/place.h"

#include "places/scene_parts.h"

namespace alces::places {

std::string_view name(Kind kind) {
  switch (kind) {
    case Kind::streets:
      return "streets";
    case Kind::corridors:
      return "corridors";
    case Kind::roundabout:
      return "roundabout";
    case Kind::field:
      return "field";
    case Kind::pass:
      return "pass";
    case Kind::aisles:
      return "aisles";
    case Kind::pillars:
      return "pillars";
    case Kind::floors:
      return "floors";
    case Kind::yards:
      return "yards";
  }
  return "unknown";
}

std::optional<Kind> kind_named(std::string_view wanted) {
  for (const Kind kind : all_kinds) {
    if (name(kind) == wanted) return kind;
  }
  return std::nullopt;
}

Place make_place(Kind kind, std::uint64_t seed) {
  constexpr Place (*make[])(std::uint64_t) = {make_streets, make_corridors, make_roundabout,
                                              make_field,   make_pass,      make_aisles,
                                              make_pillars, make_floors,    make_yards};
  Place place = make[static_cast<std::size_t>(kind)](seed);
  place.kind = kind;
  place.seed = seed;
  place.scene.build();
  return place;
}

}  // namespace alces::places
