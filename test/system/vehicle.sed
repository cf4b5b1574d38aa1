# The simulated vehicle of `alces simulate --print-config`, lighter: one laser with 101 rays on a head that turns once in
# 1.2 s, because an emulated processor casts and maps every ray. The wires are the guest's.
s/^interface = .*/interface = "vcan0"/
s/^chip = .*/chip = "alces-sim"/
s/^lines = .*/lines = ["2"]/
s#"/dev/ttyUSB0"#"/run/alces/laser_a"#
s#"/dev/ttyUSB1"#"/run/alces/laser_b"#
s#"/dev/ttyUSB2"#"/run/alces/gps"#
s/^lasers = .*/lasers = 1/
s/^field_of_view_deg = .*/field_of_view_deg = 100/
s/^target_velocity_units = .*/target_velocity_units = 3000/
s/^turn_deg = .*/turn_deg = 360/
s/^expected_profiles = .*/expected_profiles = 90/
s/^minimum_profiles = .*/minimum_profiles = 60/
s/^rays_per_profile = .*/rays_per_profile = 101/
s/^memory = "64MiB"/memory = "48MiB"/
s/^expected_speed_deg_s = .*/expected_speed_deg_s = 300/
