// What alces cannot do it says in one sentence, and leaves with the status of its reason.
#pragma once

#include <catch2/catch.hpp>
#include <string>

#include "run_alces.h"

namespace alces::offline {

/// "alces ARGUMENTS" ends with this status and a sentence that names this; after a wrong call (2) also where
/// to find help.
inline void check_refusal(const TemporaryFolder& folder, const std::string& arguments, int status,
                          const std::string& names) {
  const ProgramOutcome outcome = run_alces(folder, arguments);
  CAPTURE(arguments, outcome.err);
  CHECK(outcome.status == status);
  CHECK_THAT(outcome.err, Catch::Contains(names));
  if (status != 2) CHECK(is_one_sentence(outcome.err));
}

}  // namespace alces::offline
