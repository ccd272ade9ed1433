"""The STM32H743's peripherals as far as the firmware uses them, one a file. Registers are those of RM0433."""
