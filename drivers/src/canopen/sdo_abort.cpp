#include "alces_drivers/canopen/sdo_abort.h"

namespace alces::canopen {

const char* sdo_abort_text(std::uint32_t abort_code) {
  switch (abort_code) {
    case sdo_abort_toggle:
      return "the toggle bit did not alternate";
    case sdo_abort_timed_out:
      return "the SDO protocol timed out";
    case 0x05040001:
      return "the command specifier is not valid or unknown";
    case 0x05040002:
      return "invalid block size";
    case 0x05040003:
      return "invalid sequence number";
    case 0x05040004:
      return "CRC error";
    case sdo_abort_out_of_memory:
      return "out of memory";
    case 0x06010000:
      return "the object does not support this access";
    case 0x06010001:
      return "the object can only be written";
    case 0x06010002:
      return "the object can only be read";
    case 0x06010003:
      return "the subindex cannot be written; subindex 0 must be 0 first";
    case 0x06010004:
      return "the object does not support complete access";
    case sdo_abort_no_object:
      return "the object does not exist in the object dictionary";
    case 0x06040041:
      return "the object cannot be mapped to the PDO";
    case 0x06040042:
      return "the mapped objects would exceed the PDO's length";
    case 0x06040043:
      return "the parameters are incompatible";
    case 0x06040047:
      return "incompatible inside the device";
    case 0x06060000:
      return "a hardware error prevented the access";
    case sdo_abort_size_mismatch:
      return "the data type or its length does not match";
    case 0x06070012:
      return "the data are too long for the object's type";
    case 0x06070013:
      return "the data are too short for the object's type";
    case sdo_abort_no_subindex:
      return "the subindex does not exist";
    case 0x06090030:
      return "the value is not valid";
    case 0x06090031:
      return "the value is too high";
    case 0x06090032:
      return "the value is too low";
    case 0x06090036:
      return "the maximum is less than the minimum";
    case 0x060A0023:
      return "a resource, the SDO connection, is not available";
    case sdo_abort_general:
      return "general error";
    case 0x08000020:
      return "the data cannot be transferred or stored";
    case 0x08000021:
      return "the data cannot be transferred or stored because of local control";
    case 0x08000022:
      return "the data cannot be transferred or stored in the present device state";
    case 0x08000023:
      return "there is no object dictionary";
    case 0x08000024:
      return "no data available";
    default:
      return "an abort code that CiA 301 does not know";
  }
}

}  // namespace alces::canopen
