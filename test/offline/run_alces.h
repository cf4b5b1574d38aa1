// alces as a script calls it: arguments in, exit status and both outputs back.
#pragma once

#include <sys/wait.h>

#include <algorithm>
#include <cstdlib>
#include <string>

#include "temporary_folder.h"

namespace alces::offline {

struct ProgramOutcome {
  int status = 0;
  std::string out;
  std::string err;
};

/// Runs "alces ARGUMENTS" in `folder`, through the shell.
inline ProgramOutcome run_alces(const TemporaryFolder& folder, const std::string& arguments) {
  std::string command = "cd '" + folder.path().string();
  command += "' && '" ALCES_PROGRAM "' ";
  command += arguments;
  command += " >stdout.txt 2>stderr.txt </dev/null";
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, content_of(folder / "stdout.txt"),
          content_of(folder / "stderr.txt")};
}

inline bool is_one_sentence(const std::string& text) {
  return text.rfind("alces: ", 0) == 0 && std::count(text.begin(), text.end(), '\n') == 1;
}

}  // namespace alces::offline
