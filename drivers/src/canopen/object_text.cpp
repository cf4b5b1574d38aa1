#include "alces_drivers/canopen/object_text.h"

namespace alces::canopen {

const char* object_text(std::uint16_t index) {
  if (index >= 0x1400 && index < 0x1600)
    return "an RPDO's communication parameter: COB-ID, transmission type";
  if (index >= 0x1600 && index < 0x1800) return "an RPDO's mapping";
  if (index >= 0x1800 && index < 0x1A00) return "a TPDO's communication parameter: COB-ID, transmission type";
  if (index >= 0x1A00 && index < 0x1C00) return "a TPDO's mapping";
  const bool is_of_profile = index >= 0x6000 && index < 0xA000;
  switch (is_of_profile ? 0x6000 + (index - 0x6000) % 0x800 : index) {
    case 0x1000:
      return "device type";
    case 0x1006:
      return "communication cycle period";
    case 0x1010:
      return "store parameters";
    case 0x1011:
      return "restore default parameters";
    case 0x1016:
      return "consumer heartbeat time";
    case 0x1017:
      return "producer heartbeat time";
    case 0x1018:
      return "identity: vendor, product, revision, serial number";
    case 0x1019:
      return "synchronous counter overflow value";
    case 0x1029:
      return "error behaviour";
    case 0x6007:
      return "abort connection option code";
    case 0x603F:
      return "error code";
    case 0x6040:
      return "controlword";
    case 0x6041:
      return "statusword";
    case 0x605A:
      return "quick stop option code";
    case 0x605B:
      return "shutdown option code";
    case 0x605C:
      return "disable operation option code";
    case 0x605D:
      return "halt option code";
    case 0x605E:
      return "fault reaction option code";
    case 0x6060:
      return "modes of operation";
    case 0x6061:
      return "modes of operation display";
    case 0x6064:
      return "position actual value";
    case 0x606C:
      return "velocity actual value";
    case 0x6072:
      return "max torque";
    case 0x607E:
      return "polarity";
    case 0x607F:
      return "max profile velocity";
    case 0x6080:
      return "max motor speed";
    case 0x6081:
      return "profile velocity";
    case 0x6083:
      return "profile acceleration";
    case 0x6084:
      return "profile deceleration";
    case 0x6085:
      return "quick stop deceleration";
    case 0x6086:
      return "motion profile type";
    case 0x60C5:
      return "max acceleration";
    case 0x60C6:
      return "max deceleration";
    case 0x60FF:
      return "target velocity";
    case 0x6502:
      return "supported drive modes";
    default:
      break;
  }
  return index >= 0x2000 && index < 0x6000 ? "an object of the maker's: its manual says which"
                                           : "an object that has no name here";
}

}  // namespace alces::canopen
