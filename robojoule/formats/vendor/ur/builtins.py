"""Functions that every controller of Universal Robots has, by what they do to the robot."""

STANDING = frozenset({"sleep", "popup"})
PAYLOADS = frozenset({"set_payload", "set_payload_mass", "set_payload_cog", "set_target_payload"})
# What moves the robot, or lets it be moved, without saying here where to.
_STREAMS = """
    servoj servoc servol speedj speedl direct_torque optimovej optimovel force_mode freedrive_mode teach_mode
    screw_driving track_conveyor_linear track_conveyor_circular path_offset_enable path_offset_set set_pos
"""
STREAMS = frozenset(_STREAMS.split())
_MATHS = """
    acos asin atan atan2 binary_list_to_integer ceil cos d2r floor get_list_length integer_to_binary_list
    interpolate_pose inv length log norm normalize point_dist pose_add pose_dist pose_inv pose_sub pose_trans pow r2d
    random rotvec2rpy rpy2rotvec sin size sqrt tan transpose wrench_trans
    str_at str_cat str_empty str_find str_len str_sub to_num to_str time
"""
_STATE = """
    force get_actual_joint_positions get_actual_joint_positions_history get_actual_joint_speeds get_actual_tcp_pose
    get_actual_tcp_speed get_actual_tool_flange_pose get_controller_temp get_conveyor_tick_count
    get_coriolis_and_centrifugal_torques get_forward_kin get_freedrive_status get_gravity get_inverse_kin
    get_inverse_kin_has_solution get_inverse_kin_no_solution get_jacobian get_jacobian_time_derivative get_joint_temp
    get_joint_torques get_mass_matrix get_steptime get_target_joint_accelerations get_target_joint_positions
    get_target_joint_speeds get_target_payload get_target_payload_cog get_target_payload_inertia get_target_tcp_pose
    get_target_tcp_pose_along_path get_target_tcp_speed get_target_tcp_speed_along_path get_target_waypoint
    get_tcp_force get_tcp_offset get_tool_accelerometer_reading get_tool_current is_steady is_within_safety_limits
    encoder_get_tick_count encoder_unwind_delta_tick_count path_offset_get tool_contact tool_contact_examples
"""
_SIGNALS = """
    get_analog_in get_analog_out get_configurable_digital_in get_configurable_digital_out get_digital_in
    get_digital_out get_euromap_input get_euromap_output get_flag get_standard_analog_in get_standard_analog_out
    get_standard_digital_in get_standard_digital_out get_tool_analog_in get_tool_digital_in get_tool_digital_out
    get_tool_voltage read_input_boolean_register read_input_float_register read_input_integer_register
    read_output_boolean_register read_output_float_register read_output_integer_register read_port_bit
    read_port_register request_boolean_from_primary_client request_float_from_primary_client
    request_integer_from_primary_client request_string_from_primary_client set_analog_inputrange set_analog_out
    set_analog_outputdomain set_configurable_digital_input_action set_configurable_digital_out set_digital_out
    set_euromap_output set_euromap_runstate_dependent_choice set_flag set_gp_boolean_input_action
    set_input_actions_to_default set_runstate_configurable_digital_output_to_value
    set_runstate_gp_boolean_output_to_value set_runstate_standard_analog_output_to_value
    set_runstate_standard_digital_output_to_value set_runstate_tool_digital_output_to_value
    set_standard_analog_input_domain set_standard_analog_out set_standard_digital_input_action
    set_standard_digital_out set_tool_analog_input_domain set_tool_communication set_tool_digital_input_action
    set_tool_digital_out set_tool_digital_output_mode set_tool_output_mode set_tool_voltage
    write_output_boolean_register write_output_float_register write_output_integer_register write_port_bit
    write_port_register rpc_factory
"""
_SETTINGS = """
    assert textmsg varmsg sync powerdown end_force_mode end_freedrive_mode end_screw_driving end_teach_mode
    force_mode_set_damping force_mode_set_gain_scaling conveyor_pulse_decode encoder_enable_pulse_decode
    encoder_enable_set_tick_count encoder_set_tick_count set_conveyor_tick_count set_gravity
    set_safety_mode_transition_hardness stopj stopl stop_conveyor_tracking path_offset_disable
    path_offset_set_alpha_filter path_offset_set_max_offset pause_on_error_code position_deviation_warning
    reset_revolution_counter reset_world_model enable_external_ft_sensor ft_rtde_input_enable zero_ftsensor
    high_holding_torque_disable high_holding_torque_enable
"""
# What moves nothing and takes no time to speak of; `PREFIXES` begin the names of further ones.
HARMLESS = frozenset(f"{_MATHS} {_STATE} {_SIGNALS} {_SETTINGS}".split())
PREFIXES = ("socket_", "modbus_", "rtde_")
_KEYWORDS = """
    and break continue def elif else end enter_critical exit_critical False global halt if in join kill local loop not
    or p pi return run sec thread True while xor
"""
KEYWORDS = frozenset(_KEYWORDS.split())
ALL = HARMLESS | STREAMS | STANDING | PAYLOADS | KEYWORDS | {"set_tcp"}
