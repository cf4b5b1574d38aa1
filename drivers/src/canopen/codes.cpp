#include "alces_drivers/canopen/codes.h"

#include <algorithm>
#include <iterator>

namespace alces::canopen {
namespace {

struct SdoAbortText {
  std::uint32_t code;
  const char* text;
};

constexpr SdoAbortText sdo_aborts[] = {
    {0x05030000, "toggle bit not alternated"},
    {0x05040000, "SDO transfer timed out"},
    {0x05040001, "command specifier not valid or unknown"},
    {0x05040002, "invalid block size"},
    {0x05040003, "invalid sequence number in a block"},
    {0x05040004, "CRC error in a block transfer"},
    {0x05040005, "out of memory"},
    {0x06010000, "unsupported access to an object"},
    {0x06010001, "object is write-only"},
    {0x06010002, "object is read-only"},
    {0x06020000, "object does not exist"},
    {0x06040041, "object cannot be mapped to a PDO"},
    {0x06040042, "mapped objects exceed the PDO's length"},
    {0x06040043, "parameters do not go together"},
    {0x06040047, "internal incompatibility in the device"},
    {0x06060000, "access failed because of a hardware error"},
    {0x06070010, "data type or length does not match"},
    {0x06070012, "data too long for the object"},
    {0x06070013, "data too short for the object"},
    {0x06090011, "sub-index does not exist"},
    {0x06090030, "invalid value for the parameter"},
    {0x06090031, "value too high"},
    {0x06090032, "value too low"},
    {0x06090036, "maximum value is below the minimum value"},
    {0x060A0023, "resource not available: SDO connection"},
    {0x08000000, "general error"},
    {0x08000020, "data cannot be transferred or stored"},
    {0x08000021, "data cannot be transferred or stored: local control"},
    {0x08000022, "data cannot be transferred or stored in the present device state"},
    {0x08000023, "no object dictionary present, or it could not be generated"},
    {0x08000024, "no data available"},
};

struct EmcyText {
  std::uint16_t code;
  const char* text;
};

constexpr EmcyText emergencies[] = {
    {0x0000, "error reset, or no error"},
    {0x1000, "generic error"},
    {0x2000, "current"},
    {0x2100, "current on the device's input side"},
    {0x2110, "short circuit or earth leakage at the input"},
    {0x2120, "earth leakage at the input"},
    {0x2121, "earth leakage at input phase L1"},
    {0x2122, "earth leakage at input phase L2"},
    {0x2123, "earth leakage at input phase L3"},
    {0x2130, "short circuit at the input"},
    {0x2131, "short circuit of input phases L1 and L2"},
    {0x2132, "short circuit of input phases L2 and L3"},
    {0x2133, "short circuit of input phases L3 and L1"},
    {0x2200, "current inside the device"},
    {0x2211, "current inside the device, no. 1"},
    {0x2212, "current inside the device, no. 2"},
    {0x2213, "over-current in the ramp function"},
    {0x2214, "over-current in the sequence"},
    {0x2220, "continuous over-current inside the device"},
    {0x2221, "continuous over-current inside the device, no. 1"},
    {0x2222, "continuous over-current inside the device, no. 2"},
    {0x2230, "short circuit or earth leakage inside the device"},
    {0x2240, "earth leakage inside the device"},
    {0x2250, "short circuit inside the device"},
    {0x2300, "current on the device's output side"},
    {0x2310, "continuous over-current at the output"},
    {0x2311, "continuous over-current at the output, no. 1"},
    {0x2312, "continuous over-current at the output, no. 2"},
    {0x2320, "short circuit or earth leakage on the motor side"},
    {0x2330, "earth leakage on the motor side"},
    {0x2331, "earth leakage at motor phase U"},
    {0x2332, "earth leakage at motor phase V"},
    {0x2333, "earth leakage at motor phase W"},
    {0x2340, "short circuit on the motor side"},
    {0x2341, "short circuit of motor phases U and V"},
    {0x2342, "short circuit of motor phases V and W"},
    {0x2343, "short circuit of motor phases W and U"},
    {0x2350, "load level (I2t, thermal state)"},
    {0x2351, "load level warning (I2t, thermal state)"},
    {0x3000, "voltage"},
    {0x3100, "mains voltage"},
    {0x3110, "mains over-voltage"},
    {0x3111, "mains over-voltage, phase L1"},
    {0x3112, "mains over-voltage, phase L2"},
    {0x3113, "mains over-voltage, phase L3"},
    {0x3120, "mains under-voltage"},
    {0x3121, "mains under-voltage, phase L1"},
    {0x3122, "mains under-voltage, phase L2"},
    {0x3123, "mains under-voltage, phase L3"},
    {0x3130, "phase failure"},
    {0x3131, "phase failure L1"},
    {0x3132, "phase failure L2"},
    {0x3133, "phase failure L3"},
    {0x3134, "phase sequence"},
    {0x3140, "mains frequency"},
    {0x3141, "mains frequency too great"},
    {0x3142, "mains frequency too small"},
    {0x3200, "DC link voltage"},
    {0x3210, "DC link over-voltage"},
    {0x3211, "DC link over-voltage, no. 1"},
    {0x3212, "DC link over-voltage, no. 2"},
    {0x3220, "DC link under-voltage"},
    {0x3221, "DC link under-voltage, no. 1"},
    {0x3222, "DC link under-voltage, no. 2"},
    {0x3230, "load error"},
    {0x3300, "output voltage"},
    {0x3310, "output over-voltage"},
    {0x3311, "output over-voltage, phase U"},
    {0x3312, "output over-voltage, phase V"},
    {0x3313, "output over-voltage, phase W"},
    {0x3320, "armature circuit"},
    {0x3321, "armature circuit interrupted"},
    {0x3330, "field circuit"},
    {0x3331, "field circuit interrupted"},
    {0x4000, "temperature"},
    {0x4100, "ambient temperature"},
    {0x4110, "ambient temperature too high"},
    {0x4120, "ambient temperature too low"},
    {0x4130, "supply air temperature"},
    {0x4140, "air outlet temperature"},
    {0x4200, "device temperature"},
    {0x4210, "device temperature too high"},
    {0x4220, "device temperature too low"},
    {0x4300, "drive temperature"},
    {0x4310, "drive temperature too high"},
    {0x4320, "drive temperature too low"},
    {0x4400, "supply temperature"},
    {0x4410, "supply temperature too high"},
    {0x4420, "supply temperature too low"},
    {0x5000, "device hardware"},
    {0x5100, "supply"},
    {0x5110, "low-voltage supply"},
    {0x5111, "supply +/-15 V"},
    {0x5112, "supply +24 V"},
    {0x5113, "supply +5 V"},
    {0x5120, "supply of the intermediate circuit"},
    {0x5200, "control hardware"},
    {0x5210, "measurement circuit"},
    {0x5220, "computing circuit"},
    {0x5300, "operating unit"},
    {0x5400, "power section"},
    {0x5410, "output stages"},
    {0x5420, "chopper"},
    {0x5430, "input stages"},
    {0x5440, "contacts"},
    {0x5450, "fuses"},
    {0x5500, "data storage"},
    {0x5510, "working memory"},
    {0x5520, "program memory"},
    {0x5530, "non-volatile memory"},
    {0x6000, "device software"},
    {0x6010, "software reset (watchdog)"},
    {0x6100, "internal software"},
    {0x6200, "user software"},
    {0x6300, "data record"},
    {0x6310, "loss of parameters"},
    {0x6320, "parameter error"},
    {0x7000, "additional modules"},
    {0x7100, "power module"},
    {0x7110, "brake chopper"},
    {0x7111, "brake chopper failed"},
    {0x7112, "over-current in the brake chopper"},
    {0x7113, "protective circuit of the brake chopper"},
    {0x7120, "motor"},
    {0x7121, "motor blocked"},
    {0x7122, "motor error or commutation malfunction"},
    {0x7123, "motor tilted"},
    {0x7200, "measurement module"},
    {0x7210, "measurement circuit of the module"},
    {0x7300, "sensor"},
    {0x7301, "tachometer fault"},
    {0x7302, "tachometer polarity wrong"},
    {0x7303, "resolver 1 fault"},
    {0x7304, "resolver 2 fault"},
    {0x7305, "incremental encoder 1 fault"},
    {0x7306, "incremental encoder 2 fault"},
    {0x7307, "incremental encoder 3 fault"},
    {0x7310, "speed sensor"},
    {0x7320, "position sensor"},
    {0x7400, "computation module"},
    {0x7500, "communication module"},
    {0x7510, "serial interface 1"},
    {0x7520, "serial interface 2"},
    {0x7600, "external data storage"},
    {0x8000, "monitoring"},
    {0x8100, "communication"},
    {0x8110, "CAN overrun, objects lost"},
    {0x8120, "CAN in error-passive mode"},
    {0x8130, "life guard or heartbeat error"},
    {0x8140, "recovered from bus-off"},
    {0x8150, "CAN-ID collision"},
    {0x8200, "protocol error"},
    {0x8210, "PDO not processed: length error"},
    {0x8220, "PDO length exceeded"},
    {0x8230, "DAM MPDO not processed: destination object not available"},
    {0x8240, "unexpected SYNC data length"},
    {0x8250, "RPDO timed out"},
    {0x8300, "torque control"},
    {0x8311, "excess torque"},
    {0x8312, "difficult start-up"},
    {0x8313, "standstill torque"},
    {0x8321, "insufficient torque"},
    {0x8331, "torque fault"},
    {0x8400, "velocity controller"},
    {0x8500, "position controller"},
    {0x8600, "positioning controller"},
    {0x8611, "following error"},
    {0x8612, "reference limit"},
    {0x8700, "synchronisation controller"},
    {0x8800, "winding controller"},
    {0x8900, "process data monitoring"},
    {0x8A00, "control monitoring"},
    {0x9000, "external error"},
    {0xF000, "additional functions"},
    {0xF001, "deceleration"},
    {0xF002, "sub-synchronous run"},
    {0xF003, "stroke operation"},
    {0xF004, "control"},
    {0xFF00, "device-specific error"},
};
static_assert(std::ranges::is_sorted(sdo_aborts, {}, &SdoAbortText::code));
static_assert(std::ranges::is_sorted(emergencies, {}, &EmcyText::code));

const char* listed_emcy_text(std::uint16_t code) {
  const auto* found = std::ranges::lower_bound(emergencies, code, {}, &EmcyText::code);
  return found != std::end(emergencies) && found->code == code ? found->text : nullptr;
}

}  // namespace

const char* sdo_abort_text(std::uint32_t code) {
  const auto* found = std::ranges::lower_bound(sdo_aborts, code, {}, &SdoAbortText::code);
  return found != std::end(sdo_aborts) && found->code == code ? found->text : "unknown abort code";
}

const char* emcy_text(std::uint16_t code) {
  for (const unsigned mask : {0xFFFFU, 0xFFF0U, 0xFF00U, 0xF000U}) {
    const auto narrowed = static_cast<std::uint16_t>(code & mask);
    if (narrowed == 0 && code != 0) break;  // 0x00xx is no class, and certainly no all-clear
    if (const char* text = listed_emcy_text(narrowed)) return text;
  }
  return "unknown error code";
}

bool is_listed_emcy(std::uint16_t code) {
  return listed_emcy_text(code) != nullptr;
}

const char* error_register_bit_text(unsigned bit) {
  constexpr const char* texts[8] = {"generic",       "current",        "voltage",  "temperature",
                                    "communication", "device profile", "reserved", "manufacturer"};
  return bit < 8 ? texts[bit] : "no such bit";
}

}  // namespace alces::canopen
