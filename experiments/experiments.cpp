// The paper's experiment in the program `alces`: its two verbs, and the optimisers that ELCH is compared
// with. -DALCES_EXPERIMENTS=OFF leaves all of it out.
#include "back_ends/loop_back_ends.h"
#include "back_ends/optimize_methods.h"
#include "compare/compare_command.h"
#include "offline/program/extension.h"
#include "reference/reference_command.h"

namespace alces::offline {
namespace {

void add_verbs(CLI::App& alces) {
  add_compare_command(alces);
  add_reference_command(alces);
}

[[maybe_unused]] const bool is_added = [] {
  add_loop_back_ends();
  add_optimize_methods();
  add_extension(add_verbs);
  return true;
}();

}  // namespace
}  // namespace alces::offline
