// Keeps what drivers say to people, for tests.
#pragma once

#include <string>
#include <vector>

#include "alces_drivers/port/notice_port.h"

namespace alces {

class NoticeLog final : public NoticePort {
 public:
  void raise(const Notice& notice) override { notices.push_back(notice); }

  [[nodiscard]] bool has(const std::string& part) const {
    for (const Notice& notice : notices) {
      if (std::string(notice.text).find(part) != std::string::npos) return true;
    }
    return false;
  }

  std::vector<Notice> notices;
};

}  // namespace alces
