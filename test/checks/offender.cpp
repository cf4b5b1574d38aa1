// What the core must not do, so that the check can be seen to find it.
namespace offender {

struct Victim {
  virtual ~Victim();
  int value = 1;
};
Victim::~Victim() = default;

Victim* make() {
  return new Victim;
}

}  // namespace offender
