//! Every example that needs no files runs to its end.

macro_rules! examples {
    ($($file:literal $example:ident $test:ident),+ $(,)?) => {$(
        #[path = $file]
        mod $example;

        #[test]
        fn $test() {
            $example::main().unwrap();
        }
    )+};
}

examples! {
    "../examples/calibrate_handheld_stereo.rs" calibrate_handheld_stereo a_stereo_rig_is_calibrated,
    "../examples/convert_to_opencv.rs" convert_to_opencv a_model_is_converted,
    "../examples/custom_method.rs" custom_method a_custom_method_is_compared,
    "../examples/detect_chart.rs" detect_chart a_chart_is_detected,
    "../examples/fit_table.rs" fit_table a_table_is_fitted,
    "../examples/judge_calibration.rs" judge_calibration a_calibration_is_judged,
    "../examples/locate_batch.rs" locate_batch a_batch_is_located,
    "../examples/write_report.rs" write_report a_report_is_written,
}
